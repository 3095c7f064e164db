// SPDX-License-Identifier: BSD-3-Clause
//
// urdfdom, kept quiet.
//
//   UrdfDom dom = read_with_urdfdom(contents, text, "arm.urdf");
//   dom.model->getRoot() ...
//
// urdfdom reports by printing to the console and may return a model nevertheless (a NaN mass becomes a
// massless link).  Here its messages are caught: an error is thrown as FileError, at the line of the link or
// joint that it names, and warnings come back as notes.  The capture is process-wide inside urdfdom's logger,
// so reading is serialised by a mutex; whatever logger the program had set is restored.
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
