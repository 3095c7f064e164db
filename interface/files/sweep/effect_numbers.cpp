// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/files/sweep/effect_numbers.h>

#include <algorithm>

#include <dyntape/autodiff/record/eigen.h>
#include <dyntape/interface/files/lists.h>

namespace dyntape {

namespace {

using Shape = EffectNumber::Shape;
using Use = EffectNumber::Use;
using dynamics::ParameterInfo;

// What a value of an effect on the tape is: only what has the recording scalar can be a parameter.
struct KindOfNumber {
  Shape shape = Shape::kNumber;
  Use use = Use::kVaries;

  void see(const AD&) {}
  void see(const dynamics::Vector3<AD>&) { shape = Shape::kVector3; }
  void see(const VectorXad&) { shape = Shape::kJoints; }
  void see(double) { use = Use::kRecorded; }
  void see(const Eigen::VectorXd&) { shape = Shape::kJoints, use = Use::kRecorded; }
  template <class Value>
  void see(const std::optional<Value>& value) {
    see(value.value_or(Value{}));
    if (!value) use = Use::kNotGiven;
  }
  template <class Word>
  requires std::is_enum_v<Word>
  void see(Word) { use = Use::kWord; }
};

}  // namespace

std::vector<EffectNumber> effect_numbers(const RobotScene& scene) {
  std::vector<EffectNumber> numbers;
  const dynamics::Effects<AD> effects = scene.effects.cast<AD>();
  dynamics::for_each_chosen_effect(effects, [&](const auto& effect) {
    bool is_first = true;
    detail::for_each_parameter_of(
        effect, [&](const std::string& path, int item, const ParameterInfo& info, const auto& value) {
          KindOfNumber kind;
          kind.see(value);
          const auto known = std::find_if(numbers.begin(), numbers.end(),
                                          [&](const EffectNumber& number) { return number.path == path; });
          if (known == numbers.end()) {
            numbers.push_back({path, info, kind.shape, kind.use, item + 1, is_first && item < 0});
          } else {
            known->items = item + 1;
            if (kind.use == Use::kNotGiven) known->use = Use::kNotGiven;
          }
          is_first = false;
        });
  });
  return numbers;
}

std::vector<std::string> absent_effects(const RobotScene& scene) {
  std::vector<std::string> names;
  dynamics::for_each_effect(scene.effects, [&](const auto& effect) {
    if (!effect) names.push_back(std::string("effects.") + dynamics::effect_key(effect));
  });
  return names;
}

bool EffectPlace::overlaps(const EffectPlace& other) const {
  if (path != other.path) return false;
  if (item != kAll && other.item != kAll && item != other.item) return false;
  return std::any_of(entries.begin(), entries.end(),
                     [&](int entry) { return contains(other.entries, entry); });
}

}  // namespace dyntape
