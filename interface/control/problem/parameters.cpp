// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/problem/parameters.h>

#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/suggest.h>

namespace dyntape {

std::string entry_name(const std::string& name, Eigen::Index i, Eigen::Index size) {
  return size == 1 ? name : name + "[" + std::to_string(i) + "]";
}

namespace {

// ArgumentError, naming the entry, unless the value has this size and is finite; `when`: " at t = 0.5 s".
void check_value(const std::string& name, const Eigen::VectorXd& value, Eigen::Index size,
                 const std::string& when) {
  if (value.size() != size)
    throw ArgumentError("the parameter \"" + name + "\" has " + std::to_string(value.size()) + " entries" +
                        when + ", expected " + std::to_string(size));
  for (Eigen::Index i = 0; i < size; ++i) {
    if (std::isfinite(value[i])) continue;
    throw ArgumentError("the parameter \"" + entry_name(name, i, size) + "\" is " + std::to_string(value[i]) +
                        when + ", expected a finite number");
  }
}

std::string when_asked(double t) { return " at t = " + std::to_string(t) + " s"; }

}  // namespace

void ParameterValue::require_vector(Eigen::Index rows, Eigen::Index cols) {
  if (rows == 1 || cols == 1 || rows * cols == 0) return;
  throw ArgumentError("the value of a parameter is a matrix of " + std::to_string(rows) + " x " +
                      std::to_string(cols) + ", expected a number or a vector");
}

Eigen::VectorXd ParameterValue::at_zero(const OfTime& of_time) {
  if (of_time) return of_time(0);
  throw ArgumentError(
      "the value of a parameter is an empty function, expected one of time that gives a vector");
}

void Parameter::require(Eigen::Index available) const {
  if (first_ + size_ <= available) return;
  throw ArgumentError(
      "a stage has " + std::to_string(available) + " parameters, and a function of it reads those up to " +
      std::to_string(first_ + size_) +
      ": its handle is of another list of parameters, or the stage was made without (Problem::stage)");
}

Parameter Parameters::add(const std::string& name, ParameterValue value) {
  if (name.empty()) throw ArgumentError("a parameter has no name");
  for (const Entry& entry : entries_) {
    if (entry.name == name) throw ArgumentError("there are two parameters \"" + name + "\"");
  }
  const Eigen::Index size = value.constant.size();
  if (size == 0) throw ArgumentError("the parameter \"" + name + "\" has no entries");
  check_value(name, value.constant, size, "");
  const Parameter place(size_, size);
  size_ += size;
  entries_.push_back({name, place, std::move(value)});
  return place;
}

void Parameters::set(const std::string& name, ParameterValue value) {
  Entry& entry = entries_[index(name)];
  check_value(name, value.constant, entry.place.size(), "");
  entry.value = std::move(value);
}

std::vector<std::string> Parameters::names() const {
  std::vector<std::string> names;
  for (const Entry& entry : entries_) names.push_back(entry.name);
  return names;
}

std::size_t Parameters::index(const std::string& name) const {
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    if (entries_[i].name == name) return i;
  }
  throw ArgumentError("there is no parameter \"" + name + "\"" +
                      (entries_.empty() ? "; the problem has none" : suggestion(name, names())));
}

Parameter Parameters::find(const std::string& name) const { return entries_[index(name)].place; }

std::vector<std::string> Parameters::entry_names() const {
  std::vector<std::string> names;
  for (const Entry& entry : entries_) {
    for (Eigen::Index i = 0; i < entry.place.size(); ++i)
      names.push_back(entry_name(entry.name, i, entry.place.size()));
  }
  return names;
}

Eigen::VectorXd Parameters::at(double t) const {
  Eigen::VectorXd values(size_);
  for (const Entry& entry : entries_) {
    auto part = values.segment(entry.place.first(), entry.place.size());
    part = entry.value.constant;
    if (!entry.value.of_time) continue;
    const Eigen::VectorXd now = entry.value.of_time(t);
    const bool fits = now.size() == entry.place.size() && now.allFinite();
    if (!fits) check_value(entry.name, now, entry.place.size(), when_asked(t));  // sentences take time
    part = now;
  }
  return values;
}

std::string Parameters::first_of_time() const {
  for (const Entry& entry : entries_) {
    if (entry.value.of_time) return entry.name;
  }
  return "";
}

Parameters Parameters::later(double by) const {
  Parameters result = *this;
  for (Entry& entry : result.entries_) {
    if (entry.value.of_time)
      entry.value.of_time = [at = std::move(entry.value.of_time), by](double t) { return at(t + by); };
  }
  return result;
}

void Parameters::check_same(const Parameters& other) const {
  for (const Entry& entry : other.entries_) {
    const Parameter place = find(entry.name);
    if (place.size() == entry.place.size() && place.first() == entry.place.first()) continue;
    throw ArgumentError("the parameter \"" + entry.name + "\" has " + std::to_string(entry.place.size()) +
                        " entries from " + std::to_string(entry.place.first()) + " on, expected " +
                        std::to_string(place.size()) + " from " + std::to_string(place.first()) +
                        " on, as they were recorded");
  }
  if (other.entries_.size() < entries_.size())
    throw ArgumentError("the parameter \"" + entries_[other.entries_.size()].name + "\" is missing");
}

}  // namespace dyntape
