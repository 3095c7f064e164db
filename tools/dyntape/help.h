// SPDX-License-Identifier: BSD-3-Clause
//
// What --help prints, in as many columns as the terminal has.
//
//   set_help(app);                                       every command of it, and theirs
//   wrapped("a long sentence ...", 30, help_width());    lines of at most 80 columns, the second and on after 30 blanks
//
// Options stand on the left with what they take; on the right what they mean, then the default, or that one has to be
// given.  In descriptions a line that begins with a blank stays as it is, and others flow together
// to the end of a sentence.
#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <string>

namespace dyntape::tools {

// COLUMNS of the environment, as far as it is a width that text can have (60 to 160); else 80.
std::size_t help_width();

// Words between blanks, for a text whose first line begins in column `indent`; no line break at its end.  A word that is
// longer than a line has one of its own.
std::string wrapped(const std::string& text, std::size_t indent, std::size_t width);

// A line of a list: `left`, and from column 24 on `right`, which has lines of its own where `left` is longer.
std::string help_entry(const std::string& left, const std::string& right);

// Paragraphs of at most help_width() columns: one ends where a line does that ends a sentence.
std::string flowing(const std::string& text);

void set_help(CLI::App& app);

}  // namespace dyntape::tools
