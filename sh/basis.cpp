#include "sh/basis.h"

#include <algorithm>
#include <vector>

#include "sh/detail/check.h"
#include "sh/detail/difference_table.h"
#include "sh/detail/kernels.h"
#include "sh/detail/legendre_engine.h"

namespace daylit::sh {
namespace {

using detail::DifferenceTable;
using detail::Directions;
using detail::polar;

Error not_unit(std::size_t index, double x, double y, double z, const char* where) {
  return {ErrorCode::not_a_unit_direction,
          "direction " + std::to_string(index) + " is (" + std::to_string(x) + ", " + std::to_string(y) + ", " +
              std::to_string(z) + "), its length is not 1",
          where};
}

template <class T>
Expected<void> evaluate_one(int degree, const glm::vec<3, T>& v, std::span<T> out) {
  constexpr const char* where = "evaluate";
  if (const auto ok = detail::check_degree(degree, where); !ok)
    return ok;
  const std::size_t needed = std::size_t(degree + 1) * std::size_t(degree + 1);
  if (const auto ok = detail::check_count(out.size(), needed, "values", where); !ok)
    return ok;
  Directions<T> d{};
  if (!polar<T>(double(v.x), double(v.y), double(v.z), d))
    return not_unit(0, double(v.x), double(v.y), double(v.z), where);
  DifferenceTable<T> table;
  for (int m = 0; m <= degree; ++m) {
    table.build(m, degree - m + 1);
    detail::advance_order<T>(d, m, T(detail::sectoral_factor(m)));
    detail::evaluate_order<T, T>(d, m, table.a.data(), table.b.data(), table.q.data(), degree - m + 1,
                                 [&](int i, T c, T s) {
                                   const std::ptrdiff_t l = m + i, centre = l * l + l;
                                   out[std::size_t(centre - m)] = s;
                                   out[std::size_t(centre + m)] = c;
                                 });
  }
  return {};
}

void evaluate_order(detail::BatchState<double>& s, const detail::OrderRow<double>& r, double* out, std::size_t stride) {
  detail::kernels().evaluate_order_f64(s, r, out, stride);
}
void evaluate_order(detail::BatchState<float>& s, const detail::OrderRow<float>& r, float* out, std::size_t stride) {
  detail::kernels().evaluate_order_f32(s, r, out, stride);
}

template <class T>
Expected<void> evaluate_many(int degree, std::span<const T> x, std::span<const T> y, std::span<const T> z,
                             std::span<T> out) {
  constexpr const char* where = "evaluate_batch";
  if (const auto ok = detail::check_degree(degree, where); !ok)
    return ok;
  if (y.size() != x.size() || z.size() != x.size())
    return Error{ErrorCode::wrong_count, "x, y and z differ in length", where};
  const std::size_t needed = std::size_t(degree + 1) * std::size_t(degree + 1) * x.size();
  if (const auto ok = detail::check_count(out.size(), needed, "values", where); !ok)
    return ok;
  constexpr std::size_t kPart = 256; // state of a part stays in the first-level cache
  std::vector<T> fields(9 * (kPart + detail::kMaxBatchWidth));
  DifferenceTable<T> table;
  for (std::size_t begin = 0; begin < x.size(); begin += kPart) {
    detail::BatchState<T> state{{}, std::min(kPart, x.size() - begin)};
    for (std::size_t k = 0; k < 9; ++k)
      state.field[k] = fields.data() + k * (kPart + detail::kMaxBatchWidth);
    for (std::size_t i = 0; i < state.count; ++i) {
      Directions<T> d{};
      const std::size_t at = begin + i;
      if (!polar<T>(double(x[at]), double(y[at]), double(z[at]), d))
        return not_unit(at, double(x[at]), double(y[at]), double(z[at]), where);
      const T values[5] = {d.mu, d.sine, d.hemisphere, d.cosine1, d.sine1};
      for (std::size_t k = 0; k < 5; ++k)
        state.field[k][i] = values[k];
    }
    for (int m = 0; m <= degree; ++m) {
      table.build(m, degree - m + 1);
      const detail::OrderRow<T> row{
          table.a.data(), table.b.data(), table.q.data(), m, degree - m + 1, T(detail::sectoral_factor(m))};
      evaluate_order(state, row, out.data() + begin, x.size());
    }
  }
  return {};
}

template <class T, class Kernel>
Expected<void> evaluate_nine(std::span<const T> x, std::span<const T> y, std::span<const T> z, std::span<T> out,
                             std::size_t plane_stride, Kernel kernel) {
  constexpr const char* where = "evaluate9_batch";
  if (y.size() != x.size() || z.size() != x.size() || plane_stride < x.size())
    return Error{ErrorCode::wrong_count, "x, y and z differ in length, or planes overlap", where};
  if (x.empty())
    return {};
  if (out.size() < 8 * plane_stride + x.size())
    return Error{ErrorCode::wrong_count,
                 "room for " + std::to_string(out.size()) + " values, nine planes need " +
                     std::to_string(8 * plane_stride + x.size()),
                 where};
  kernel(detail::DirectionArrays<T>{x.data(), y.data(), z.data(), x.size()}, out.data(), plane_stride);
  return {};
}

} // namespace

const char* instruction_set() { return detail::kernels().name; }

Expected<void> evaluate(int degree, const glm::dvec3& direction, std::span<double> out) {
  return evaluate_one<double>(degree, direction, out);
}
Expected<void> evaluate(int degree, const glm::vec3& direction, std::span<float> out) {
  return evaluate_one<float>(degree, direction, out);
}
Expected<void> evaluate_order(int order, int degree, const glm::dvec3& direction, std::span<double> cosine_part,
                              std::span<double> sine_part) {
  constexpr const char* where = "evaluate_order";
  if (const auto ok = detail::check_degree(degree, where); !ok)
    return ok;
  if (order < 0 || order > degree)
    return Error{ErrorCode::parameter_out_of_range,
                 "order is " + std::to_string(order) + ", must be 0 to " + std::to_string(degree), where};
  const int count = degree - order + 1;
  for (const auto part : {cosine_part, sine_part})
    if (const auto ok = detail::check_count(part.size(), std::size_t(count), "values", where); !ok)
      return ok;
  Directions<double> d{};
  if (!polar<double>(direction.x, direction.y, direction.z, d))
    return not_unit(0, direction.x, direction.y, direction.z, where);
  for (int m = 0; m <= order; ++m)
    detail::advance_order<double>(d, m, detail::sectoral_factor(m));
  DifferenceTable<double> table;
  table.build(order, count);
  detail::evaluate_order<double, double>(d, order, table.a.data(), table.b.data(), table.q.data(), count,
                                         [&](int i, double c, double s) {
                                           cosine_part[std::size_t(i)] = c;
                                           sine_part[std::size_t(i)] = s;
                                         });
  return {};
}

Expected<void> evaluate_batch(int degree, std::span<const double> x, std::span<const double> y,
                              std::span<const double> z, std::span<double> out) {
  return evaluate_many<double>(degree, x, y, z, out);
}
Expected<void> evaluate_batch(int degree, std::span<const float> x, std::span<const float> y, std::span<const float> z,
                              std::span<float> out) {
  return evaluate_many<float>(degree, x, y, z, out);
}
Expected<void> evaluate9_batch(std::span<const float> x, std::span<const float> y, std::span<const float> z,
                               std::span<float> out, std::size_t plane_stride) {
  return evaluate_nine<float>(x, y, z, out, plane_stride, detail::kernels().evaluate9_f32);
}
Expected<void> evaluate9_batch(std::span<const double> x, std::span<const double> y, std::span<const double> z,
                               std::span<double> out, std::size_t plane_stride) {
  return evaluate_nine<double>(x, y, z, out, plane_stride, detail::kernels().evaluate9_f64);
}

} // namespace daylit::sh
