// SPDX-License-Identifier: BSD-3-Clause
//
// Reads a text with urdfdom, without output on the console.
//
//   UrdfDom dom = read_with_urdfdom(contents, text, "arm.urdf");
//   dom.model->getRoot() ...
//
// urdfdom prints its messages and may return a model despite an error (a NaN mass becomes a massless link).  This
// function catches the messages: an error is thrown as FileError, at the line of the link or joint that it names,
// and warnings are returned as notes.  urdfdom's logger is process-wide, so a mutex serialises reading; the
// program's logger is restored.
#pragma once

#include <urdf_model/model.h>

#include <memory>
#include <string>
#include <vector>

#include <dyntape/dynamics/urdf/text.h>

namespace dyntape::dynamics {

struct UrdfDom {
  std::shared_ptr<const urdf::ModelInterface> model;
  std::vector<std::string> notes;
};

UrdfDom read_with_urdfdom(const std::string& contents, const UrdfText& text, const std::string& file);

}  // namespace dyntape::dynamics
