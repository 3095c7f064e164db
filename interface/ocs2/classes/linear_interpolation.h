// SPDX-License-Identifier: BSD-3-Clause
//
// OCS2's interpolation between the values of an array of times, and its search for the interval of a time.
//
//   auto [k, alpha] = LinearInterpolation::timeSegment(0.25, times);        // alpha of value k, 1 - alpha of the next
//   vector_t x = LinearInterpolation::interpolate(0.25, times, states);
//
// Before the first time and after the last time, returns the value at that end.  If there are no times, or there is
// one entry, returns that entry.  If neighbours have different sizes, returns the nearer one.  In segments shorter
// than 2e-9 s, returns the value at the nearer end.
#pragma once

#include <algorithm>
#include <type_traits>
#include <utility>
#include <vector>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/ocs2/names.h>

namespace dyntape::ocs2 {

namespace lookup {

// The index of the interval that contains the time, among (-inf, t_0], (t_0, t_1], ..., (t_last, inf): 0 to
// timeArray.size().
inline int findIndexInTimeArray(const scalar_array_t& timeArray, scalar_t time) {
  return static_cast<int>(std::lower_bound(timeArray.begin(), timeArray.end(), time) - timeArray.begin());
}
// The segment that contains the time: -1 at and before the first time, timeArray.size() - 1 after the last time; 0
// if there are no times.
inline int findIntervalInTimeArray(const scalar_array_t& timeArray, scalar_t time) {
  return timeArray.empty() ? 0 : findIndexInTimeArray(timeArray, time) - 1;
}
// The same with the first time in the first segment.
inline int findActiveIntervalInTimeArray(const scalar_array_t& timeArray, scalar_t time) {
  return !timeArray.empty() && time == timeArray.front() ? 0 : findIntervalInTimeArray(timeArray, time);
}
// Also throws ArgumentError if the time is outside all segments.
inline int findBoundedActiveIntervalInTimeArray(const scalar_array_t& timeArray, scalar_t time) {
  const int found = findActiveIntervalInTimeArray(timeArray, time);
  if (found < 0 || found + 1 >= static_cast<int>(timeArray.size()))
    throw ArgumentError("findBoundedActiveIntervalInTimeArray: the time is outside of the times");
  return found;
}

}  // namespace lookup

namespace LinearInterpolation {

using index_alpha_t = std::pair<int, scalar_t>;

namespace detail {

inline constexpr scalar_t kShortest = 2e-9;  // s

inline bool is_similar(const auto& a, const auto& b) {
  if constexpr (requires {
                  a.rows();
                  a.cols();
                }) {
    return a.rows() == b.rows() && a.cols() == b.cols();
  } else {
    return true;
  }
}

struct Itself {
  template <class T, class Alloc>
  const T& operator()(const std::vector<T, Alloc>& data, std::size_t k) const {
    return data[k];
  }
};

}  // namespace detail

inline index_alpha_t timeSegment(scalar_t enquiryTime, const scalar_array_t& timeArray) {
  if (timeArray.size() <= 1) return {0, 1};
  const int last = static_cast<int>(timeArray.size()) - 1;
  const int k = lookup::findIntervalInTimeArray(timeArray, enquiryTime);
  if (k < 0) return {0, 1};
  if (k >= last) return {last - 1, 0};
  const scalar_t begin = timeArray[static_cast<std::size_t>(k)],
                 end = timeArray[static_cast<std::size_t>(k) + 1];
  if (end - begin > detail::kShortest) return {k, (end - enquiryTime) / (end - begin)};
  return {k, end - enquiryTime > enquiryTime - begin ? 1.0 : 0.0};
}

// accessor(data, k): the quantity of entry k to interpolate.
template <class Data, class Alloc, class Accessor = detail::Itself>
auto interpolate(index_alpha_t indexAlpha, const std::vector<Data, Alloc>& dataArray,
                 Accessor accessor = {}) {
  if (dataArray.empty()) throw ArgumentError("interpolate: there is no data");
  using Value = std::remove_cvref_t<decltype(accessor(dataArray, std::size_t(0)))>;
  const std::size_t k = static_cast<std::size_t>(indexAlpha.first);
  const scalar_t alpha = indexAlpha.second;
  if (dataArray.size() == 1) return Value(accessor(dataArray, 0));
  if (k + 1 >= dataArray.size()) throw ArgumentError("interpolate: more times than data");
  const auto& left = accessor(dataArray, k);
  const auto& right = accessor(dataArray, k + 1);
  if (!detail::is_similar(left, right)) return Value(alpha > 0.5 ? left : right);
  return Value(alpha * left + (scalar_t(1) - alpha) * right);
}

template <class Data, class Alloc, class Accessor = detail::Itself>
auto interpolate(scalar_t enquiryTime, const scalar_array_t& timeArray,
                 const std::vector<Data, Alloc>& dataArray, Accessor accessor = {}) {
  return interpolate(timeSegment(enquiryTime, timeArray), dataArray, accessor);
}

// The call of OCS2 before 2021: the result is an argument.  Returns the segment.
template <class Field, class Data, class Alloc, class Accessor = detail::Itself>
requires(!std::is_same_v<std::remove_cvref_t<Field>, scalar_array_t>) index_alpha_t
    interpolate(scalar_t enquiryTime, Field& enquiryData, const scalar_array_t& timeArray,
                const std::vector<Data, Alloc>& dataArray, Accessor accessor = {}) {
  const index_alpha_t segment = timeSegment(enquiryTime, timeArray);
  enquiryData = interpolate(segment, dataArray, accessor);
  return segment;
}

}  // namespace LinearInterpolation

// References over time, which costs follow.
struct TargetTrajectories {
  TargetTrajectories() = default;
  TargetTrajectories(scalar_array_t times, vector_array_t states, vector_array_t inputs = {})
      : timeTrajectory(std::move(times)),
        stateTrajectory(std::move(states)),
        inputTrajectory(std::move(inputs)) {}

  bool empty() const { return timeTrajectory.empty() || stateTrajectory.empty(); }
  std::size_t size() const { return timeTrajectory.size(); }
  void clear() { *this = {}; }
  vector_t getDesiredState(scalar_t time) const { return desired(stateTrajectory, "states", time); }
  vector_t getDesiredInput(scalar_t time) const { return desired(inputTrajectory, "inputs", time); }

  scalar_array_t timeTrajectory;
  vector_array_t stateTrajectory, inputTrajectory;

 private:
  vector_t desired(const vector_array_t& of, const char* what, scalar_t time) const {
    if (of.empty()) throw ArgumentError(std::string("TargetTrajectories has no ") + what);
    return LinearInterpolation::interpolate(time, timeTrajectory, of);
  }
};

}  // namespace dyntape::ocs2
