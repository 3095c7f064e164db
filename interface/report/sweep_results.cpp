// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/report/sweep_results.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <set>
#include <sstream>
#include <tuple>

#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/io/facts.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/result_folder.h>

namespace dyntape {

namespace {

constexpr std::size_t kShownFailures = 5;

// Entries of a column where the row is ok.
std::vector<double> sound_column(const io::CsvTable& table, const std::string& name) {
  const int column = table.index(name), ok = table.index("ok");
  std::vector<double> values;
  for (int row = 0; row < table.rows(); ++row) {
    if (table(row, ok) == 1) values.push_back(table(row, column));
  }
  return values;
}

// What an axis measures.
struct Measured {
  std::string name, unit;  // "m", "rad or m"; "": none, or not known
};

// "rad", or of several units "rad or m"; "" if one of them is not known.
std::string any_of(const std::vector<std::string>& units) {
  std::string text;
  for (const std::string& unit : std::set<std::string, std::greater<>>(units.begin(), units.end())) {
    if (unit.empty()) return "";
    text += (text.empty() ? "" : " or ") + unit;
  }
  return text;
}

// Entries of (q, v).
std::string unit_of_entries(const dynamics::Model<double>& model, const std::vector<int>& entries) {
  std::vector<std::string> units;
  for (const int entry : entries) {
    const std::string unit = unit_of_state(model, entry);
    units.push_back(unit.empty() ? "" : unit.substr(1));
  }
  return any_of(units);
}

// The part of "N m/rad or N/m" that is of these degrees of freedom.
std::string unit_of_joints(const dynamics::Model<double>& model, const std::string& both,
                           const std::vector<int>& dofs) {
  const std::size_t at = both.find(" or ");
  if (at == both.npos) return both;
  std::vector<std::string> units;
  for (const int dof : dofs)
    units.push_back(unit_of_state(model, model.nq + dof) == " m/s" ? both.substr(at + 4)
                                                                   : both.substr(0, at));
  return any_of(units);
}

// Of a result: "q2, base z" in m.
Measured quantity_of_result(const Scene& scene, const std::string& name) {
  if (name == "t") return {"t", "s"};
  if (name.starts_with("energy.") || name == "most.energy") return {name, "J"};
  const dynamics::Model<double>& model = scene.robot.model;
  if (name == "most.v") {
    std::vector<int> all(std::size_t(model.nv));
    std::iota(all.begin(), all.end(), model.nq);
    return {name, unit_of_entries(model, all)};
  }
  std::vector<std::string> names = entry_names(model, "q");
  for (const std::string& of_v : entry_names(model, "v")) names.push_back(of_v);
  const auto at = std::find(names.begin(), names.end(), name);
  if (at == names.end()) return {name, ""};
  const int index = int(at - names.begin());
  const int of_base = index < model.nq ? index : index - model.nq;
  const bool is_base = floats(model) && of_base < (index < model.nq ? 7 : 6);
  constexpr const char* kAxes[] = {"x", "y", "z"};
  constexpr const char* kOrientation[] = {"quaternion x", "quaternion y", "quaternion z", "quaternion w"};
  std::string told = name;
  if (is_base && of_base < 3) told += std::string(", base ") + kAxes[of_base];
  if (is_base && of_base >= 3)
    told += std::string(", base ") +
            (index < model.nq ? kOrientation[of_base - 3] : ("about " + std::string(kAxes[of_base - 3])));
  return {told, unit_of_entries(model, {index})};
}

// Units of the numbers that a place names: of starts by their entries, of effects and robots by what they are.
struct UnitOfPlace {
  const Scene& scene;
  const dynamics::Model<double>& model = scene.robot.model;

  std::string operator()(const BasePlace& base) const {
    if (base.part == &BaseStart::position) return "m";
    if (base.part == &BaseStart::roll_pitch_yaw) return "rad";
    return base.part == &BaseStart::velocity ? "m/s" : "rad/s";
  }
  std::string operator()(const StartPlace& start) const {
    std::vector<int> entries = start.entries;
    if (start.block == StartPlace::Block::kTorque) {
      const std::vector<int> driven = actuated_dofs(scene.robot);
      for (int& entry : entries) entry = driven[std::size_t(entry)];
      return unit_of_joints(model, "N m or N", entries);
    }
    if (start.block == StartPlace::Block::kVelocity)
      for (int& entry : entries) entry += model.nq;
    return unit_of_entries(model, entries);
  }
  std::string operator()(const RobotPlace& robot) const {
    if (robot.name.starts_with("mass:")) return "kg";
    return robot.name.starts_with("com") ? "m" : "";
  }
  std::string operator()(const EffectPlace& place) const {
    for (const EffectNumber& number : effect_numbers(scene.robot)) {
      if (number.path != place.path) continue;
      const std::string unit = number.info.unit;
      if (number.shape != EffectNumber::Shape::kJoints) return unit;
      return unit_of_joints(model, unit, dofs_of(place, number.info.length));
    }
    return "";
  }

 private:
  std::vector<int> dofs_of(const EffectPlace& place, dynamics::Length length) const {
    if (length == dynamics::Length::kJoints) return place.entries;
    std::vector<int> dofs;
    for (const auto& joint : model.joints)
      if (std::find(place.entries.begin(), place.entries.end(), joint.idx_q) != place.entries.end())
        dofs.push_back(joint.idx_v);
    return dofs;
  }
};

Measured quantity_of_value(const Scene& scene, const SweptValue& value) {
  const std::string unit = std::visit(UnitOfPlace{scene}, value.place);
  return {value.name, unit == "1" ? "" : unit};
}

// Numbers along an axis in thousands, millionths, ... where plain ones would be long.
struct Axis {
  std::string label;
  std::vector<double> values;
};
Axis readable(const Measured& quantity, std::vector<double> values) {
  double most = 0;
  for (double x : values) most = std::max(most, std::abs(x));
  const auto label = [&](const std::string& factor) {
    const std::string unit = factor + (factor.empty() || quantity.unit.empty() ? "" : " ") + quantity.unit;
    return quantity.name + (unit.empty() ? "" : " [" + unit + "]");
  };
  if (most == 0 || (most < 1e4 && most >= 1e-2)) return {label(""), std::move(values)};
  const double power = 3 * std::floor(std::log10(most) / 3), unit = std::pow(10, power);
  for (double& x : values) x /= unit;
  return {label("1e" + std::to_string(int(power))), std::move(values)};
}

bool is_random(const SceneSweep& sweep) {
  return std::any_of(sweep.values.begin(), sweep.values.end(),
                     [](const SweptValue& value) { return value.spread != Spread::kGrid; });
}

// The outline of a histogram.
io::Series histogram(const std::vector<double>& values) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  const double low = *least, width = *most - *least;
  const auto bins = std::size_t(std::clamp(2 * std::cbrt(double(values.size())), 1.0, 60.0));  // Rice's rule
  std::vector<double> count(bins, 0);
  for (double x : values) {
    const double place = width > 0 ? (x - low) / width * double(bins) : 0;
    count[std::min(std::size_t(place), bins - 1)] += 1;
  }
  io::Series outline{.x = {low}, .y = {0}};
  for (std::size_t k = 0; k < bins; ++k) {
    for (double side : {double(k), double(k + 1)}) {
      outline.x.push_back(low + width * side / double(bins));
      outline.y.push_back(count[k]);
    }
  }
  outline.x.push_back(low + width), outline.y.push_back(0);
  return outline;
}

}  // namespace

Quantiles quantiles_of(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const auto at = [&](double part) {
    return values[std::size_t(std::lround(part * double(values.size() - 1)))];
  };
  return {at(0), at(0.05), at(0.5), at(0.95), at(1)};
}

io::Plot sweep_plot(const SceneSweep& sweep, const io::CsvTable& table) {
  constexpr std::size_t kMostValues = 3;
  io::Plot plot{.title = sweep.name};
  const std::size_t shown = std::min(sweep.values.size(), kMostValues);
  const bool has_histogram = is_random(sweep);  // of points of a grid it would tell where they were put
  plot.columns = int(shown) + has_histogram;
  plot.width = 330 * plot.columns + 60;
  for (const std::string& result : sweep.shown) {
    const std::vector<double> y = sound_column(table, result);
    if (y.empty()) return {};
    const Axis along = readable(quantity_of_result(sweep.scene, result), y);
    for (std::size_t k = 0; k < shown; ++k) {
      const SweptValue& value = sweep.values[k];
      const bool is_log = value.spread == Spread::kLogUniform;
      const Measured quantity = quantity_of_value(sweep.scene, value);
      Axis x{quantity.name + (quantity.unit.empty() ? "" : " [" + quantity.unit + "]"),
             io::thinned(sound_column(table, value.name))};
      if (!is_log) x = readable(quantity, std::move(x.values));
      io::Panel panel{.x_label = x.label, .y_label = along.label, .log_x = is_log};
      panel.series = {{.x = std::move(x.values),
                       .y = io::thinned(along.values),
                       .mark = io::Mark::kPoints,
                       .point = 0.4}};
      plot.panels.push_back(std::move(panel));
    }
    if (!has_histogram) continue;
    plot.panels.push_back(
        {.x_label = along.label, .y_label = "samples", .series = {histogram(along.values)}});
  }
  return plot;
}

bool SweepReport::success() const {
  return !outcome.was_stopped && long(outcome.failures.size()) < outcome.rows;
}

std::string SweepReport::verdict() const {
  const std::string all = io::with_groups(sweep.rows()) + " samples";
  if (outcome.was_stopped) {
    if (outcome.rows == 0)
      return "stopped before the first of " + all + " was complete; repeat the command to begin again";
    return "stopped after " + io::with_groups(outcome.rows) + " of " + all +
           "; repeat the command to continue";
  }
  std::string text = all;
  if (outcome.was_finished) text += ", finished by an earlier run";
  if (outcome.resumed > 0) text += ", " + io::with_groups(outcome.resumed) + " of them there before";
  const std::size_t failed = outcome.failures.size();
  return text + (failed == 0 ? "" : ", " + io::with_groups(long(failed)) + " of all failed");
}

namespace {

// Least to most: of each result for programs, of some for people where there are any.
void tell_quantiles(const SceneSweep& sweep, const SweepOutcome& outcome, io::Facts& facts) {
  std::vector<io::TextColumn> columns = {{"result"}};
  for (const char* name : {"least", "5 %", "median", "95 %", "most"})
    columns.push_back({name, "", io::Align::kRight});
  io::TextTable table(columns);
  for (const std::string& name : result_names(sweep.scene)) {
    const Quantiles q = quantiles_of(sound_column(outcome.table, name));
    facts["quantiles"][name] = {q.least, q.low, q.median, q.high, q.most};
    if (name == "t" || name.starts_with("v")) continue;
    std::vector<std::string> row = {name};
    for (double x : {q.least, q.low, q.median, q.high, q.most}) row.push_back(io::with_digits(x, 5));
    table.append(row);
  }
  if (outcome.failures.size() < std::size_t(outcome.rows)) facts.below("\n" + table.text());
}

io::Facts facts_of(const SweepReport& report) {
  const auto& [sweep, outcome] = std::tie(report.sweep, report.outcome);
  io::Facts facts(sweep.name + ": " + report.verdict());
  facts["sweep"] = sweep.name;
  facts.say("scene", sweep.scene.name + ", " + io::with_groups(sweep.scene.steps()) + " steps of " +
                         to_string(sweep.scene.integrator));
  facts["scene"] = sweep.scene.name;
  facts["identity"] =
      outcome.was_stopped || !report.unwritten.empty() ? "" : outcome.identity;  // of results that are whole
  facts["success"] = report.success() && report.unwritten.empty();
  facts["verdict"] = report.verdict();
  facts["samples"] = sweep.rows();
  facts.say("seed", std::to_string(sweep.seed));
  facts["seed"] = sweep.seed;
  facts["resumed"] = outcome.resumed;
  facts["failed"] = outcome.failures.size();
  facts["operations"] = outcome.operations;
  facts["seconds"] = {{"build", outcome.build_seconds}, {"steps", outcome.step_seconds}};
  if (!outcome.was_finished) {
    const double speed = double(outcome.rows - outcome.resumed) / std::max(outcome.step_seconds, 1e-9);
    facts.say("one step", io::with_groups(long(outcome.operations)) + " operations");
    facts.say("ready after", io::duration(outcome.build_seconds));
    facts.say("computed in", io::duration(outcome.step_seconds) + ", " + io::significant(speed, 3) +
                                 " samples a second, " +
                                 io::significant(speed * double(sweep.scene.steps()), 3) + " steps a second");
  }
  if (!outcome.was_stopped) tell_quantiles(sweep, outcome, facts);
  const std::vector<std::string>& failures = outcome.failures;
  for (std::size_t k = 0; k < std::min(failures.size(), kShownFailures); ++k)
    facts.below((k == 0 ? "\n" : "") + failures[k] + "\n");
  if (failures.size() > kShownFailures)
    facts.below("and " + io::with_groups(long(failures.size() - kShownFailures)) + " more\n");
  facts["unwritten"] = report.unwritten;
  return facts;
}

}  // namespace

std::string SweepReport::text() const { return facts_of(*this).text(); }
std::string SweepReport::json() const { return facts_of(*this).json(); }

void write_sweep_results(SweepReport& report, const std::string& folder, const std::stop_token& stop) {
  io::ResultFolder results(folder, report.unwritten);
  const SweepOutcome& outcome = report.outcome;
  results.write_text(kSweepTable, outcome.csv);
  std::string failures;
  for (const std::string& failure : outcome.failures) failures += failure + "\n";
  results.remove(kSweepFailures);
  if (!failures.empty()) results.write_text(kSweepFailures, failures);
  results.write_text(kSweepUnderstood, report.sweep.effective);
  results.remove(kSweepPicture);
  const io::Plot plot = sweep_plot(report.sweep, outcome.table);
  if (!plot.panels.empty())
    results.write(kSweepPicture, [&](const std::string& path) { io::draw(plot, path, "gnuplot", stop); });
  results.write_text(kSweepReport, report.json());
}

SweepOutcome finished_outcome(const SceneSweep& sweep, const std::string& folder) {
  SweepOutcome outcome;
  outcome.was_finished = true;
  outcome.identity = identity_of(sweep);
  outcome.table = io::read_csv(folder + "/" + kSweepTable);
  outcome.rows = outcome.table.rows();
  std::error_code none;
  if (!std::filesystem::is_regular_file(folder + "/" + kSweepFailures, none)) return outcome;
  std::istringstream lines(read_file(folder + "/" + kSweepFailures));
  for (std::string line; std::getline(lines, line);) outcome.failures.push_back(line);
  return outcome;
}

}  // namespace dyntape
