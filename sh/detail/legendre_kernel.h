// Included by kernels.cpp inside an anonymous namespace, after vector.h. Legendre sums of one order for a block of
// ring pairs. Index i counts degrees from m: even i is symmetric in x, odd i antisymmetric, so the sums over even and
// odd degrees give the northern ring as their sum and the southern one as their difference.

void start_order(const RingBlock& block, int first, int m, double factor) {
  for (int v = first; v < block.vectors; ++v) {
    Vec mantissa = load(block.sectoral + v * kLanes);
    Vec exponent = load(block.sectoral_exp + v * kLanes);
    mantissa *= m == 0 ? Vec{} + factor : load(block.sine + v * kLanes) * factor;
    const Mask small = mantissa < kSmall;
    mantissa = small ? mantissa * kScaleUp : mantissa;
    exponent = small ? exponent - 1.0 : exponent;
    store(block.sectoral + v * kLanes, mantissa);
    store(block.sectoral_exp + v * kLanes, exponent);
    store(block.p0 + v * kLanes, mantissa);
    store(block.p1 + v * kLanes, Vec{});
    store(block.exponent + v * kLanes, exponent);
    block.live[v] = !any(exponent < 0.0);
  }
}

/// Lifts lanes that grew above kBig by one exponent; `weight` becomes 1 in lanes whose numbers are plain doubles.
/// Recurrence coefficients stay below 2^7 for degrees up to 10,000, so kStep steps cannot overflow in between.
inline void rescale(Vec& p0, Vec& p1, Vec& exponent, Vec& weight) {
  const Mask grown = ((p0 > kBig) | (p0 < -kBig) | (p1 > kBig) | (p1 < -kBig)) & (exponent < 0.0);
  if (any(grown)) {
    p0 = grown ? p0 * kScaleDown : p0;
    p1 = grown ? p1 * kScaleDown : p1;
    exponent = grown ? exponent + 1.0 : exponent;
  }
  weight = exponent < 0.0 ? Vec{} : Vec{} + 1.0;
}

struct Pair {
  Vec x, p0, p1;
};

inline Pair load_pair(const RingBlock& block, int v) {
  return {load(block.x + v * kLanes), load(block.p0 + v * kLanes), load(block.p1 + v * kLanes)};
}

inline void store_pair(const RingBlock& block, int v, const Pair& s) {
  store(block.p0 + v * kLanes, s.p0);
  store(block.p1 + v * kLanes, s.p1);
}

/// Adds degrees [begin, end) of G live vectors starting at v to accumulators [v][even, odd][component].
template <int G, int Components>
inline void synthesise_live(const RingBlock& block, const double* alpha, int v, int begin, int end, const double* c,
                            double* accumulators) {
  Pair s[G];
  Vec sum[G][2][Components];
  for (int g = 0; g < G; ++g) {
    s[g] = load_pair(block, v + g);
    for (int k = 0; k < Components; ++k) {
      sum[g][0][k] = load(accumulators + ((v + g) * 2 * Components + k) * kLanes);
      sum[g][1][k] = load(accumulators + ((v + g) * 2 * Components + Components + k) * kLanes);
    }
  }
  for (int i = begin; i < end; i += 2) {
    const double* even = c + i * Components;
    const double* odd = even + Components;
    for (int k = 0; k < Components; ++k)
      for (int g = 0; g < G; ++g)
        sum[g][0][k] += s[g].p0 * even[k];
    for (int g = 0; g < G; ++g)
      s[g].p1 = (s[g].x * alpha[i + 1]) * s[g].p0 - s[g].p1;
    for (int k = 0; k < Components; ++k)
      for (int g = 0; g < G; ++g)
        sum[g][1][k] += s[g].p1 * odd[k];
    for (int g = 0; g < G; ++g)
      s[g].p0 = (s[g].x * alpha[i + 2]) * s[g].p1 - s[g].p0;
  }
  for (int g = 0; g < G; ++g) {
    store_pair(block, v + g, s[g]);
    for (int k = 0; k < Components; ++k) {
      store(accumulators + ((v + g) * 2 * Components + k) * kLanes, sum[g][0][k]);
      store(accumulators + ((v + g) * 2 * Components + Components + k) * kLanes, sum[g][1][k]);
    }
  }
}

/// Advances one vector that is not live yet by kStep degrees from i and writes P of these degrees to `values`
/// (0 in lanes that are still below the range). Returns false when all of them are 0.
inline bool scaled_step(const RingBlock& block, const double* alpha, int v, int i, Vec* values) {
  Pair s = load_pair(block, v);
  Vec exponent = load(block.exponent + v * kLanes), weight;
  rescale(s.p0, s.p1, exponent, weight);
  const bool visible = any(weight > 0.0);
  for (int j = 0; j < kStep; j += 2) {
    values[j] = s.p0 * weight;
    s.p1 = (s.x * alpha[i + j + 1]) * s.p0 - s.p1;
    values[j + 1] = s.p1 * weight;
    s.p0 = (s.x * alpha[i + j + 2]) * s.p1 - s.p0;
  }
  store_pair(block, v, s);
  store(block.exponent + v * kLanes, exponent);
  block.live[v] = !any(exponent < 0.0);
  return visible;
}

template <int Components>
void synthesise_scaled(const RingBlock& block, const double* alpha, int v, int begin, int end, const double* c,
                       double* accumulators) {
  Vec values[kStep];
  double* sum = accumulators + v * 2 * Components * kLanes;
  int i = begin;
  for (; i < end && !block.live[v]; i += kStep) {
    if (!scaled_step(block, alpha, v, i, values))
      continue;
    for (int k = 0; k < 2 * Components; ++k) { // k < Components: even degrees, then odd ones
      Vec total = load(sum + k * kLanes);
      for (int j = k / Components; j < kStep; j += 2)
        total += values[j] * c[(i + j) * Components + k % Components];
      store(sum + k * kLanes, total);
    }
  }
  if (i < end)
    synthesise_live<1, Components>(block, alpha, v, i, end, c, accumulators);
}

template <int Components>
void write_amplitudes(const RingBlock& block, int first, int m, const double* accumulators, const Amplitudes& out) {
  for (int v = first; v < block.vectors; ++v)
    for (int k = 0; k < Components; ++k) {
      const Vec even = load(accumulators + (v * 2 * Components + k) * kLanes);
      const Vec odd = load(accumulators + (v * 2 * Components + Components + k) * kLanes);
      const std::size_t channel = k / 2, part = k % 2;
      for (int south = 0; south < 2; ++south) {
        const std::size_t row = (std::size_t(v) * 2 + south) * out.channels + channel;
        store(out.data + ((row * out.order_stride + m) * 2 + part) * kLanes, south ? even - odd : even + odd);
      }
    }
}

template <int Components>
void synthesise_components(const RingBlock& block, const OrderTable& table, int first, int m, const double* c,
                           double* accumulators, const Amplitudes& out) {
  for (int v = first; v < block.vectors; ++v)
    for (int k = 0; k < 2 * Components; ++k)
      store(accumulators + (v * 2 * Components + k) * kLanes, Vec{});
  for (int begin = 0; begin < table.count; begin += kChunk) {
    const int end = begin + kChunk < table.count ? begin + kChunk : table.count;
    for (int v = first; v < block.vectors;) {
      if (!block.live[v]) {
        synthesise_scaled<Components>(block, table.alpha, v, begin, end, c, accumulators);
        ++v;
      } else if (kGroup == 2 && v + 1 < block.vectors && block.live[v + 1]) {
        synthesise_live<kGroup, Components>(block, table.alpha, v, begin, end, c, accumulators);
        v += 2;
      } else {
        synthesise_live<1, Components>(block, table.alpha, v, begin, end, c, accumulators);
        ++v;
      }
    }
  }
  write_amplitudes<Components>(block, first, m, accumulators, out);
}

void synthesise_order(const RingBlock& block, const OrderTable& table, int first, int m, const double* c,
                      double* accumulators, const Amplitudes& out) {
  if (out.channels == 3)
    synthesise_components<6>(block, table, first, m, c, accumulators, out);
  else
    synthesise_components<2>(block, table, first, m, c, accumulators, out);
}

/// Even and odd parts (north + south, north - south) of the amplitudes of order m: inputs[v][even, odd][component].
template <int Components>
void read_amplitudes(const RingBlock& block, int first, int m, const Amplitudes& in, double* inputs) {
  for (int v = first; v < block.vectors; ++v)
    for (int k = 0; k < Components; ++k) {
      const std::size_t row = std::size_t(v) * 2 * in.channels + k / 2;
      const Vec north = load(in.data + ((row * in.order_stride + m) * 2 + k % 2) * kLanes);
      const Vec south = load(in.data + (((row + in.channels) * in.order_stride + m) * 2 + k % 2) * kLanes);
      store(inputs + (v * 2 * Components + k) * kLanes, north + south);
      store(inputs + (v * 2 * Components + Components + k) * kLanes, north - south);
    }
}

/// sums[i - base][component] += P x input for degrees [begin, end) of G live vectors.
template <int G, int Components>
inline void analyse_live(const RingBlock& block, const double* alpha, int v, int begin, int end, const double* inputs,
                         double* sums) {
  Pair s[G];
  Vec in[G][2][Components];
  for (int g = 0; g < G; ++g) {
    s[g] = load_pair(block, v + g);
    for (int k = 0; k < 2 * Components; ++k)
      in[g][k / Components][k % Components] = load(inputs + ((v + g) * 2 * Components + k) * kLanes);
  }
  for (int i = begin; i < end; i += 2, sums += 2 * Components * kLanes) {
    for (int k = 0; k < Components; ++k) {
      Vec total = load(sums + k * kLanes);
      for (int g = 0; g < G; ++g)
        total += s[g].p0 * in[g][0][k];
      store(sums + k * kLanes, total);
    }
    for (int g = 0; g < G; ++g)
      s[g].p1 = (s[g].x * alpha[i + 1]) * s[g].p0 - s[g].p1;
    for (int k = 0; k < Components; ++k) {
      Vec total = load(sums + (Components + k) * kLanes);
      for (int g = 0; g < G; ++g)
        total += s[g].p1 * in[g][1][k];
      store(sums + (Components + k) * kLanes, total);
    }
    for (int g = 0; g < G; ++g)
      s[g].p0 = (s[g].x * alpha[i + 2]) * s[g].p1 - s[g].p0;
  }
  for (int g = 0; g < G; ++g)
    store_pair(block, v + g, s[g]);
}

template <int Components>
void analyse_scaled(const RingBlock& block, const double* alpha, int v, int begin, int end, const double* inputs,
                    double* sums) {
  Vec values[kStep];
  int i = begin;
  for (; i < end && !block.live[v]; i += kStep) {
    if (!scaled_step(block, alpha, v, i, values))
      continue;
    for (int j = 0; j < kStep; ++j)
      for (int k = 0; k < Components; ++k) {
        double* sum = sums + ((i + j - begin) * Components + k) * kLanes;
        store(sum, load(sum) + values[j] * load(inputs + (v * 2 * Components + (j % 2) * Components + k) * kLanes));
      }
  }
  if (i < end)
    analyse_live<1, Components>(block, alpha, v, i, end, inputs, sums + (i - begin) * Components * kLanes);
}

template <int Components>
void analyse_components(const RingBlock& block, const OrderTable& table, int first, int m, double* sums,
                        double* scratch, const Amplitudes& in) {
  double* inputs = scratch + kChunk * Components * kLanes;
  read_amplitudes<Components>(block, first, m, in, inputs);
  for (int begin = 0; begin < table.count; begin += kChunk) {
    const int end = begin + kChunk < table.count ? begin + kChunk : table.count;
    for (int j = 0; j < (end - begin) * Components; ++j)
      store(scratch + j * kLanes, Vec{});
    for (int v = first; v < block.vectors;) {
      if (!block.live[v]) {
        analyse_scaled<Components>(block, table.alpha, v, begin, end, inputs, scratch);
        ++v;
      } else if (kGroup == 2 && v + 1 < block.vectors && block.live[v + 1]) {
        analyse_live<kGroup, Components>(block, table.alpha, v, begin, end, inputs, scratch);
        v += 2;
      } else {
        analyse_live<1, Components>(block, table.alpha, v, begin, end, inputs, scratch);
        ++v;
      }
    }
    for (int j = 0; j < (end - begin) * Components; j += 2) // Components is even
      add_lane_sums(load(scratch + j * kLanes), load(scratch + (j + 1) * kLanes), sums + begin * Components + j);
  }
}

void analyse_order(const RingBlock& block, const OrderTable& table, int first, int m, double* sums, double* scratch,
                   const Amplitudes& in) {
  if (in.channels == 3)
    analyse_components<6>(block, table, first, m, sums, scratch, in);
  else
    analyse_components<2>(block, table, first, m, sums, scratch, in);
}
