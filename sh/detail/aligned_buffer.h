#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <new>

#include "sh/detail/kernels.h"

namespace daylit::sh::detail {

/// Doubles aligned for the widest vectors; grows, never shrinks, starts as zeros.
class AlignedBuffer {
public:
  AlignedBuffer() = default;
  explicit AlignedBuffer(std::size_t count) { reserve(count); }
  AlignedBuffer(const AlignedBuffer& other) : AlignedBuffer(other.size_) {
    std::copy_n(other.data_.get(), size_, data_.get());
  }
  AlignedBuffer(AlignedBuffer&&) noexcept = default;
  AlignedBuffer& operator=(AlignedBuffer other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }

  /// At least `count` doubles; contents are lost when it has to grow.
  double* reserve(std::size_t count) {
    if (count > size_) {
      data_.reset(new (std::align_val_t(kAlignment)) double[count]());
      size_ = count;
    }
    return data_.get();
  }
  double* data() { return data_.get(); }
  const double* data() const { return data_.get(); }
  double& operator[](std::size_t i) { return data_[i]; }
  double operator[](std::size_t i) const { return data_[i]; }

private:
  struct Free {
    void operator()(double* p) const { ::operator delete[](p, std::align_val_t(kAlignment)); }
  };
  std::unique_ptr<double[], Free> data_;
  std::size_t size_ = 0;
};

} // namespace daylit::sh::detail
