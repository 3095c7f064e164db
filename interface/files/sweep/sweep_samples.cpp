// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/files/sweep/random_numbers.h>
#include <dyntape/interface/files/sweep/sweep.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/robot/model_parameters.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;

// Drawn until it lies within its limits, which the reader has found likely enough.
double normal_within(const SweptValue& value, const RandomSource& random, Draw draw) {
  constexpr std::uint32_t kMostAttempts = 100000;
  for (; draw.attempt < kMostAttempts; ++draw.attempt) {
    const double x = value.mean + value.deviation * random.normal(draw);
    if (x >= value.from && x <= value.to) return x;
  }
  throw ArgumentError("'" + value.name + "': no number between its limits was drawn in " +
                      std::to_string(kMostAttempts) + " attempts");
}

double random_value(const SweptValue& value, const RandomSource& random, const Draw& draw) {
  if (value.spread == Spread::kNormal) return normal_within(value, random, draw);
  const double s = random.uniform(draw);
  if (value.spread == Spread::kUniform) return value.from + s * (value.to - value.from);
  const double low = portable_log(value.from), high = portable_log(value.to);
  return std::clamp(portable_exp(low + s * (high - low)), value.from, value.to);
}

double grid_value(const SweptValue& value, long step) {
  if (step == value.steps - 1 && value.steps > 1) return value.to;
  return value.from + (value.to - value.from) * (double(step) / double(std::max(1L, value.steps - 1)));
}

// Values of the kind that a recording has as parameters, split into those of the robot and of the effects.
template <class T>
void put_parameters(const SceneSweep& sweep, dynamics::Model<T>& model, dynamics::Effects<T>& effects,
                    const dynamics::VectorX<T>& p) {
  std::vector<std::string> names;
  std::vector<T> of_robot;
  Eigen::Index k = 0;
  for (const SweptValue& value : sweep.values) {
    if (!value.is_parameter()) continue;
    if (const auto* place = std::get_if<EffectPlace>(&value.place)) put(effects, *place, T(p[k]));
    if (const auto* place = std::get_if<RobotPlace>(&value.place)) {
      names.push_back(place->name);
      of_robot.push_back(p[k]);
    }
    ++k;
  }
  if (names.empty()) return;
  const dynamics::VectorX<T> numbers =
      Eigen::Map<const dynamics::VectorX<T>>(of_robot.data(), Eigen::Index(of_robot.size()));
  model = ModelParameters(sweep.scene.robot.model, names).template apply<T>(numbers);
}

// What a row starts from as the scene says it.
struct StartNumbers {
  BaseStart base;
  VectorXd q, v;
  Eigen::MatrixXd u;
};

void put_start(StartNumbers& start, const ValuePlace& at, double x) {
  if (const auto* place = std::get_if<BasePlace>(&at)) (start.base.*(place->part))[place->axis] = x;
  const auto* place = std::get_if<StartPlace>(&at);
  if (!place) return;
  for (int entry : place->entries) {
    if (place->block == StartPlace::Block::kPosition) start.q[entry] = x;
    if (place->block == StartPlace::Block::kVelocity) start.v[entry] = x;
    if (place->block == StartPlace::Block::kTorque) start.u.row(entry).setConstant(x);
  }
}

StartNumbers start_numbers(const SceneSweep& sweep, const VectorXd& values) {
  StartNumbers start{sweep.scene.base, sweep.scene.q, sweep.scene.v, sweep.scene.commands.u};
  for (std::size_t k = 0; k < sweep.values.size(); ++k)
    put_start(start, sweep.values[k].place, values[Eigen::Index(k)]);
  if (floats(sweep.scene.robot.model)) place_base(start.base, start.q, start.v);
  const Ties ties = ties_of(sweep.scene.robot);
  start.q = ties.tied_q(start.q), start.v = ties.tied_v(start.v);
  return start;
}

// What gives the bits of the sweep.
CodegenOptions of_single_samples(CodegenOptions options) {
  options.functions = Functions::kPortable;
  options.lanes = Lanes::kNone;
  return options;
}

VectorXd parameters_in(const SceneSweep& sweep, const VectorXd& values) {
  VectorXd p(parameters_of(sweep));
  Eigen::Index next = 0;
  for (std::size_t k = 0; k < sweep.values.size(); ++k) {
    if (sweep.values[k].is_parameter()) p[next++] = values[Eigen::Index(k)];
  }
  return p;
}

// "mass 1.5, start.q 0.2"
std::string named_numbers(const SceneSweep& sweep, const VectorXd& values) {
  std::string numbers;
  for (std::size_t k = 0; k < sweep.values.size(); ++k)
    numbers += (k ? ", " : "") + sweep.values[k].name + " " + io::shortest(values[Eigen::Index(k)]);
  return numbers;
}

}  // namespace

long SceneSweep::rows() const {
  long rows = samples;
  for (const SweptValue& value : values) rows *= value.spread == Spread::kGrid ? value.steps : 1;
  return rows;
}

VectorXd values_of(const SceneSweep& sweep, long row) {
  const RandomSource random(sweep.seed);
  VectorXd values(Eigen::Index(sweep.values.size()));
  long point = row / sweep.samples;
  for (std::size_t k = sweep.values.size(); k-- > 0;) {  // the last value runs fastest
    const SweptValue& value = sweep.values[k];
    if (value.spread == Spread::kGrid) {
      values[Eigen::Index(k)] = grid_value(value, point % value.steps);
      point /= value.steps;
    } else {
      const Draw draw{.sample = std::uint64_t(row), .value = std::uint32_t(k)};
      values[Eigen::Index(k)] = random_value(value, random, draw);
    }
  }
  return values;
}

SampleStart start_of(const SceneSweep& sweep, const VectorXd& values) {
  const StartNumbers start = start_numbers(sweep, values);
  const VectorXd u = Commands{sweep.scene.commands.t, start.u}.at(0, {});
  return {state_of(sweep.scene.robot, start.q, start.v, u), parameters_in(sweep, values), start.u};
}

Scene scene_of(const SceneSweep& sweep, long row) {
  const VectorXd values = values_of(sweep, row);
  StartNumbers start = start_numbers(sweep, values);
  Scene scene = sweep.scene;
  scene.name += " " + std::to_string(row);
  scene.inputs = sweep.inputs;
  scene.base = start.base;
  scene.q = std::move(start.q), scene.v = std::move(start.v), scene.commands.u = std::move(start.u);
  scene.evaluation = of_single_samples(sweep.evaluation);
  const std::string numbers = named_numbers(sweep, values);
  scene.notes.push_back("sample " + std::to_string(row) + " of " + sweep.name + ": " + numbers);
  scene.effective = "; Sample " + std::to_string(row) + " of " + sweep.file +
                    ", in which these numbers stand instead of those below:\n;   " + numbers + "\n" +
                    scene.effective;
  put_parameters<double>(sweep, scene.robot.model, scene.robot.effects, parameters_in(sweep, values));
  return scene;
}

int parameters_of(const SceneSweep& sweep) {
  return int(std::count_if(sweep.values.begin(), sweep.values.end(),
                           [](const SweptValue& value) { return value.is_parameter(); }));
}

SceneEdit edit_of(const SceneSweep& sweep) {
  return [sweep](RecordedScene& scene, const VectorXad& p) {
    put_parameters<AD>(sweep, scene.model, scene.effects, p);
  };
}

}  // namespace dyntape
