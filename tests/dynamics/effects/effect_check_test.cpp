// SPDX-License-Identifier: BSD-3-Clause
//
// What effects tell of themselves: parameters, casts, and what is wrong with them.
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>

#include <algorithm>
#include <set>

#include "dynamics/all_effects.h"

namespace dyntape::dynamics::effect_check_test {
namespace {

using Eigen::VectorXd;

// Visits the parameters of all chosen effects and of their items.
template <class T, class Visit>
void for_each_parameter(const Effects<T>& effects, Visit visit) {
  for_each_chosen_effect(effects, [&]<class E>(const E& effect) {
    E::visit_parameters(effect, [&](const ParameterInfo& info, const auto& x) { visit(E::kKey, info, x); });
    if constexpr (requires { typename E::Item; }) {
      for (const auto& item : effect)
        E::Item::visit_parameters(item,
                                  [&](const ParameterInfo& info, const auto& x) { visit(E::kKey, info, x); });
    }
  });
}

struct Numbers {
  std::vector<double> all;
  void operator()(const char*, const ParameterInfo& info, const auto& x) { add(info, x); }
  template <class X>
  void add(const ParameterInfo& info, const X& x) {
    if constexpr (requires { x.has_value(); }) {
      all.push_back(x.has_value());
      if (x) add(info, *x);
    } else if constexpr (requires { x.size(); }) {
      for (int k = 0; k < x.size(); ++k) all.push_back(static_cast<double>(x[k]));
    } else {
      all.push_back(static_cast<double>(x));
    }
  }
};

class EffectsOfSeed : public ::testing::TestWithParam<unsigned long> {
 protected:
  EffectsOfSeed() : random(GetParam()), model(random_tree(random)), effects(all_effects(model, random)) {}

  std::string complaint() const {
    try {
      check(model, effects);
    } catch (const ArgumentError& error) {
      return error.what();
    }
    return "";
  }

  Random random;
  Model<double> model;
  Effects<double> effects;
};

TEST_P(EffectsOfSeed, ACastKeepsEveryNumber) {
  Numbers here, there;
  for_each_parameter(effects, std::ref(here));
  const Effects<Float128> exact = effects.cast<Float128>();
  for_each_parameter(exact, std::ref(there));
  EXPECT_GT(here.all.size(), 100U);
  EXPECT_EQ(here.all, there.all);
  Numbers back;
  for_each_parameter(exact.cast<double>(), std::ref(back));
  EXPECT_EQ(here.all, back.all);
  ASSERT_EQ(exact.contacts.size(), effects.contacts.size());
  for (std::size_t k = 0; k < effects.contacts.size(); ++k) {
    EXPECT_EQ(exact.contacts[k].body, effects.contacts[k].body);
    EXPECT_EQ(exact.contacts[k].X_BF.p.cast<double>(), effects.contacts[k].X_BF.p);
  }
}

TEST_P(EffectsOfSeed, EachTellsWhatItIs) {
  std::set<std::string> keys, names;
  for_each_effect(effects, [&](const auto& effect) {
    keys.insert(effect_key(effect)), names.insert(effect_name(effect));
  });
  EXPECT_EQ(keys.size(), 15U);
  EXPECT_EQ(names.size(), 15U);
  for_each_parameter(effects, [&]<class X>(const char* key, const ParameterInfo& info, const X&) {
    SCOPED_TRACE(std::string(key) + " " + info.name);
    EXPECT_GT(std::string(info.what).size(), 3U);
    EXPECT_EQ(std::is_enum_v<X>, info.choices != nullptr);
    EXPECT_LE(info.least, info.most);
    EXPECT_GE(info.fallback.value_or(info.most), info.least);
  });
}

TEST_P(EffectsOfSeed, WhatIsWrongIsNamed) {
  EXPECT_EQ(complaint(), "");
  const Effects<double> right = effects;
  const auto single = std::find_if(model.joints.rbegin(), model.joints.rend(),
                                   [](const auto& joint) { return is_single(joint.type); });
  const std::string last = "of joint \"" + single->name + "\"";
  const long k = single->idx_v;
  effects.damping->coefficient[k] = -0.5;
  EXPECT_EQ(complaint(), "effects: joint damping: coefficient " + last +
                             " is -0.5 N m s/rad or N s/m, expected at least 0");
  effects = right, effects.limits->margin[k] = 0;
  EXPECT_EQ(complaint(), "effects: joint limits: margin " + last + " is 0 rad or m, expected above 0");
  effects = right;
  for (const auto& joint : model.joints) {  // nobody says a value of these
    if (!is_single(joint.type)) effects.limits->margin.segment(joint.idx_v, nv(joint.type)).setZero();
  }
  EXPECT_EQ(complaint(), "");
  effects = right, effects.springs->rest.conservativeResize(1);
  EXPECT_EQ(complaint(), "effects: joint springs: rest has 1 entries, expected " + std::to_string(model.nq) +
                             " for model \"random tree\"");
  effects = right, effects.contacts[1].stiffness = std::nan("");
  EXPECT_EQ(complaint(),
            "effects: contact 1 of contacts: stiffness is nan N/m^exponent, expected at least 0");
  effects = right, effects.drag.medium[2] = 1 / 0.0;
  EXPECT_EQ(complaint(), "effects: drag: medium along z is inf m/s, expected a finite number");
  effects = right, effects.friction->stribeck_speed.reset();
  EXPECT_EQ(complaint(), "effects: joint friction: stribeck_speed is not given, expected with the others");
  effects = right, effects.buoyancy[0].body = 77;
  EXPECT_EQ(complaint(),
            "effects: body 0 of buoyancy: acts on body 77, expected one of the 10 of model \"random "
            "tree\", or -1 for the world");
  effects = right, effects.saturation->limit.setConstant(JointLimits::kNone);
  EXPECT_EQ(complaint(), "");
}

INSTANTIATE_TEST_SUITE_P(Seeds, EffectsOfSeed, ::testing::Range(1UL, 4UL));

TEST(EffectItems, AreFixedToFramesByName) {
  Random random(2);
  const Model<double> model = random_tree(random);
  Buoy<double> buoy;
  place_at_frame(model, "frame 3", buoy);
  EXPECT_EQ(buoy.body, 3);
  EXPECT_EQ(buoy.X_BF.p, model.frames[3].X_BF.p);
  EXPECT_THROW(place_at_frame(model, "fram 3", buoy), ArgumentError);
}

}  // namespace
}  // namespace dyntape::dynamics::effect_check_test
