// SPDX-License-Identifier: BSD-3-Clause
#include "report.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/table.h>

#include "host.h"

namespace dyntape::tools {
namespace {

using Strings = std::vector<std::string>;

void add_once(Strings& names, const std::string& name) {
  if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
}

Strings subjects_of(const Study& study, const std::string& part) {
  Strings subjects;
  for (const StudyRow& row : study.rows)
    if (row.part == part) add_once(subjects, row.subject);
  return subjects;
}

// Those with a point to draw, each of which takes a colour.
Strings methods_of(const Study& study) {
  Strings methods;
  for (const StudyRow& row : study.rows)
    if (!std::isnan(row.value)) add_once(methods, row.method);
  return methods;
}

std::string picture_name(const Study& study, const StudyPart& part) {
  return study.name + "_" + part.name + ".svg";
}

// As an entry of CSV.
std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string q = "\"";
  for (char c : text) q += c == '"' ? "\"\"" : std::string(1, c);
  return q + "\"";
}

// Of a line of CSV, which quoted() wrote.
Strings entries_of(const std::string& line) {
  Strings entries = {""};
  bool is_quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"' && is_quoted && i + 1 < line.size() && line[i + 1] == '"')
      entries.back() += line[++i];
    else if (c == '"')
      is_quoted = !is_quoted;
    else if (c == ',' && !is_quoted)
      entries.emplace_back();
    else
      entries.back() += c;
  }
  return entries;
}

double number_of(const std::string& entry) {
  return entry.empty() ? std::numeric_limits<double>::quiet_NaN() : std::stod(entry);
}

std::string number_or_none(double value) { return std::isnan(value) ? "" : io::shortest(value); }

// Two decades below all else of a panel, where some point is an exact zero.
double place_of_zeros(const Study& study, const StudyPart& part, const std::string& subject) {
  double least = HUGE_VAL;
  bool any = false;
  for (const StudyRow& row : study.rows) {
    if (row.part != part.name || row.subject != subject || std::isnan(row.value)) continue;
    if (row.value > 0) least = std::min(least, row.value);
    any |= row.value == 0;
  }
  if (!any || !std::isfinite(least)) return std::numeric_limits<double>::quiet_NaN();
  return std::pow(10, std::floor(std::log10(least)) - 1);
}

std::string table_of_troubles(const Study& study) {
  std::string text;
  for (const StudyRow& row : study.rows) {
    if (row.trouble.empty()) continue;
    text += "| " + row.part + " | " + row.subject + " | " + row.method + " | " +
            number_or_none(row.parameter) + " | " + row.trouble + " |\n";
  }
  if (text.empty()) return "";
  return "## What failed\n\n| part | subject | method | at | why |\n|---|---|---|--:|---|\n" + text + "\n";
}

std::string listed(const Strings& sentences) {
  std::string text;
  for (const std::string& sentence : sentences) text += "- " + sentence + "\n";
  return text;
}

}  // namespace

std::vector<StudyRow> curve(const Study& study, const std::string& part, const std::string& subject,
                            const std::string& method) {
  std::vector<StudyRow> rows;
  for (const StudyRow& row : study.rows)
    if (row.part == part && row.subject == subject && row.method == method) rows.push_back(row);
  return rows;
}

const StudyRow& point(const Study& study, const std::string& part, const std::string& subject,
                      const std::string& method, double parameter) {
  for (const StudyRow& row : study.rows) {
    if (row.part == part && row.subject == subject && row.method == method &&
        (std::isnan(parameter) || std::abs(row.parameter - parameter) <= 1e-12 * std::abs(parameter)))
      return row;
  }
  throw ArgumentError("study " + study.name + ": there is no point of " + method + " on " + subject + " in " +
                      part);
}

std::string study_csv(const Study& study, const StudyOptions& options) {
  std::ostringstream text;
  text << "part,subject,method,parameter,seconds,value,trouble,seed,processor,compiler,dyntape\n";
  for (const StudyRow& row : study.rows) {
    text << row.part << "," << quoted(row.subject) << "," << quoted(row.method) << ","
         << number_or_none(row.parameter) << "," << number_or_none(row.seconds) << ","
         << number_or_none(row.value) << "," << quoted(row.trouble) << "," << options.seed << ","
         << quoted(processor_name()) << "," << quoted(compiler_name()) << "," << DYNTAPE_VERSION << "\n";
  }
  return text.str();
}

std::vector<StudyRow> read_study_csv(const std::string& path) {
  std::istringstream lines(read_file(path));
  std::vector<StudyRow> rows;
  std::string line;
  std::getline(lines, line);
  for (int number = 2; std::getline(lines, line); ++number) {
    const Strings entries = entries_of(line);
    if (entries.size() != 11)
      throw FileError(path + ", line " + std::to_string(number) + ": " + std::to_string(entries.size()) +
                      " entries; expected the 11 of a study's table");
    StudyRow row{entries[0], entries[1], entries[2]};
    row.parameter = number_of(entries[3]), row.seconds = number_of(entries[4]);
    row.value = number_of(entries[5]), row.trouble = entries[6];
    rows.push_back(std::move(row));
  }
  return rows;
}

io::Plot study_picture(const Study& study, const StudyPart& part) {
  const Strings subjects = subjects_of(study, part.name), methods = methods_of(study);
  io::Plot plot{.title = part.title,
                .columns = int(subjects.size() == 4 ? 2 : std::clamp<std::size_t>(subjects.size(), 1, 3))};
  plot.width = plot.columns == 1 ? 860 : plot.columns == 2 ? 1060 : 1280;
  plot.one_legend = true;
  for (const std::string& subject : subjects) {
    io::Panel panel{
        .title = subject, .x_label = part.x_label, .log_x = true, .log_y = part.log_y, .height = 300};
    if (plot.panels.size() % std::size_t(plot.columns) == 0) panel.y_label = part.y_label;
    if (part.log_y) panel.zero = place_of_zeros(study, part, subject);
    if (std::isfinite(panel.zero)) panel.y_limits.low = panel.zero / 4;  // not on the axis
    for (std::size_t k = 0; k < methods.size(); ++k) {
      io::Series series{.name = methods[k], .mark = part.mark, .style = int(k)};
      for (const StudyRow& row : curve(study, part.name, subject, methods[k])) {
        const double x = part.x == StudyPart::kSeconds ? row.seconds : row.parameter;
        if (std::isnan(x) || std::isnan(row.value)) continue;
        series.x.push_back(x * part.x_scale), series.y.push_back(row.value);
      }
      if (series.x.empty()) continue;
      panel.series.push_back(std::move(series));
    }
    if (!panel.series.empty()) plot.panels.push_back(std::move(panel));
  }
  return plot;
}

std::string study_page(const Study& study, const StudyOptions& options) {
  std::string text = "# " + study.title + "\n\n*" + study.question + "*\n\n";
  for (const StudyPart& part : study.parts) {
    text += "## " + part.title + "\n\n![" + part.title + "](" + picture_name(study, part) + ")\n\n" +
            listed(part.findings) + "\n";
  }
  text += table_of_troubles(study);
  if (!study.left_out.empty()) text += "## Left out\n\n" + listed(study.left_out) + "\n";
  text += "## How it was measured\n\n" + listed(study.methods);
  text += "- By `dyntape study " + study.name + (options.quick ? " --quick" : "") + "`, seed " +
          std::to_string(options.seed) + ", on " + processor_name() + ", " + compiler_name() + ", dyntape " +
          DYNTAPE_VERSION + "; all points are in [" + study.name + ".csv](" + study.name + ".csv).\n";
  return text;
}

std::string study_text(const Study& study) {
  std::string text = study.question + "\n";
  for (const StudyPart& part : study.parts) text += "\n" + part.title + "\n" + listed(part.findings);
  const auto troubles = std::count_if(study.rows.begin(), study.rows.end(),
                                      [](const StudyRow& row) { return !row.trouble.empty(); });
  if (troubles > 0)
    text += "\n" + std::to_string(troubles) + " points failed; the page says which and why.\n";
  return text;
}

std::vector<std::string> draw_study(const Study& study, const std::string& folder) {
  std::vector<std::string> files;
  for (const StudyPart& part : study.parts) {
    files.push_back(folder + "/" + picture_name(study, part));
    io::draw(study_picture(study, part), files.back());
  }
  return files;
}

std::vector<std::string> write_study(const Study& study, const StudyOptions& options,
                                     const std::string& folder) {
  std::vector<std::string> files;
  const auto write = [&](const std::string& name, const std::string& text) {
    files.push_back(folder + "/" + name);
    write_file_atomically(files.back(), text);
  };
  write(study.name + ".csv", study_csv(study, options));
  const std::vector<std::string> drawn = draw_study(study, folder);
  files.insert(files.end(), drawn.begin(), drawn.end());
  write(study.name + ".md", study_page(study, options));
  return files;
}

}  // namespace dyntape::tools
