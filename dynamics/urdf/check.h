// SPDX-License-Identifier: BSD-3-Clause
//
// Checks a URDF text before urdfdom reads it.
//
//   std::vector<std::string> notes = check_urdf(text);   // FileError "file:line: sentence" on the first fault
//
// Faults (errors)
//   remains of xacro, before xacro has run: xacro: elements, ${...} and $(...) in links and joints; declarations in
//   a document type; names missing, used twice, not UTF-8 or of several lines; unknown parent or child; a link with
//   two parents; two roots; a loop; joint types other than revolute, continuous, prismatic, planar, fixed, and
//   floating of a child of the root link; a zero axis; limits missing, negative (velocity, effort) or reversed
//   (lower > upper); numbers that are not finite; a mass below zero; an inertia tensor with a principal moment below
//   zero by more than rounding: 1e-9 of its largest entry, 1e-12 m^2 of its mass, or 1e-15 kg m^2.
// Oddities (notes, `file:line: sentence`)
//   principal moments a <= b <= c with c > (a + b)(1 + 1e-6): no body has such an inertia, but public files contain
//   it; rotational inertia without mass; an axis that is not of unit length; absent position limits (urdfdom reads
//   0); mimic joints (read as independent joints; with `follow_mimics`, a missing or fixed leader is a fault); an
//   element given twice (the first counts); faults in elements that only draw: <visual>, <collision> and <material>,
//   the first of which is quoted.
//
// Zero mass and zero inertia are legal: point masses and massless links between joints are common.
#pragma once

#include <string>
#include <vector>

#include <dyntape/dynamics/urdf/text.h>

namespace dyntape::dynamics {

// `accept_nonphysical_inertia` makes this fault a note, because public files contain it.
std::vector<std::string> check_urdf(const UrdfText& text, bool accept_nonphysical_inertia = false,
                                    bool follow_mimics = false);

// How the note on a joint with a <mimic> that is not followed ends: `joint "a" mimics "b"; ...`.
inline constexpr const char* kReadAsIndependent = "; it is read as an independent joint";

// The parts of the check, in the order of check_urdf.
void check_urdf_encoding(const UrdfText& text);
void check_urdf_is_expanded(const UrdfText& text, std::vector<std::string>& notes);
void check_urdf_names(const UrdfText& text);
void check_urdf_numbers(const UrdfText& text, std::vector<std::string>& notes);
void check_urdf_tree(const UrdfText& text);
void check_urdf_links(const UrdfText& text, bool accept_nonphysical_inertia, std::vector<std::string>& notes);
void check_urdf_joints(const UrdfText& text, bool follow_mimics, std::vector<std::string>& notes);

// Elements that dyntape does not read, by kind: `<collision> of 8 links`, `<safety_controller> of joint "knee"`,
// `<transmission>`.
std::vector<std::string> elements_left_out(const UrdfText& text);

// Whether an element below a link, or below <robot>, has no effect on how the robot moves.
bool only_draws(const tinyxml2::XMLElement& element);

// Adds a note for each child that is given more than once.
void note_repeated(const UrdfText& text, const tinyxml2::XMLElement& element,
                   std::initializer_list<const char*> tags, std::vector<std::string>& notes);

}  // namespace dyntape::dynamics
