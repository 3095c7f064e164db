// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/report/player/player.h>

#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/report/player/page_template.h>
#include <dyntape/interface/report/player/scene.h>

namespace dyntape {

namespace {

void demand(bool holds, const std::string& what) {
  if (!holds) throw ArgumentError("player: " + what);
}

std::string digits_of(std::size_t n) { return std::to_string(n); }

void check_samples(const PlayerInput& input) {
  const auto samples = std::size_t(input.t.size());
  demand(samples > 0, "t has no samples; expected at least one");
  demand(input.q.rows() == input.model.nq && std::size_t(input.q.cols()) == samples,
         "q is " + digits_of(std::size_t(input.q.rows())) + " x " + digits_of(std::size_t(input.q.cols())) +
             "; expected nq x samples, " + std::to_string(input.model.nq) + " x " + digits_of(samples));
  demand(input.t.allFinite(), "t holds a number that is not finite");
  demand(input.q.allFinite(), "q holds a number that is not finite");
  for (Eigen::Index k = 1; k < input.t.size(); ++k)
    demand(input.t[k] >= input.t[k - 1], "t decreases after sample " + std::to_string(k - 1));
  demand(std::isfinite(input.t[input.t.size() - 1] - input.t[0]), "t spans more than a double can say");
}

void check_contacts(const PlayerInput& input) {
  const auto samples = std::size_t(input.t.size());
  demand(input.contacts.empty() || input.contacts.size() == samples,
         "contacts has " + digits_of(input.contacts.size()) + " lists; expected none or one a sample, " +
             digits_of(samples));
  for (const auto& contacts : input.contacts) {
    for (const PlayerContact& contact : contacts)
      demand(contact.point.allFinite() && contact.force.allFinite(), "a contact is not finite");
  }
}

void check_player_values(const PlayerInput& input) {
  for (const PlayerValue& value : input.values) {
    demand(value.values.size() == input.t.size(),
           "value '" + value.name + "' has " + digits_of(std::size_t(value.values.size())) +
               " samples; expected " + digits_of(std::size_t(input.t.size())));
    demand(value.values.allFinite(), "value '" + value.name + "' holds a number that is not finite");
  }
}

void check_terrain(const PlayerInput& input) {
  demand(!input.plane || !input.heights, "both a plane and heights are given; expected one of them");
  if (input.plane) {
    const auto& [normal, offset] = *input.plane;
    demand(normal.allFinite() && normal.stableNorm() > 0 && std::isfinite(offset),
           "the plane has no finite normal and offset");
  }
  if (!input.heights) return;
  const PlayerHeights& h = *input.heights;
  demand(h.heights.rows() >= 2 && h.heights.cols() >= 2, "heights are less than 2 x 2 points");
  demand(h.corner.allFinite() && h.step.allFinite() && h.step.minCoeff() > 0 && h.heights.allFinite(),
         "heights need finite numbers and steps above zero");
}

void check_visuals(const PlayerInput& input) {
  for (const dynamics::Visual& shape : input.visuals.shapes) {
    demand(shape.body >= -1 && shape.body < input.model.njoints(),
           "a shape of link '" + shape.link + "' is on body " + std::to_string(shape.body) +
               "; expected one of the robot's " + std::to_string(input.model.njoints()) +
               ", or -1 for the world");
    demand(shape.shape != dynamics::Shape::kMesh || shape.mesh,
           "a mesh of link '" + shape.link + "' is empty");
  }
}

void check_frames(const PlayerFrames& frames) {
  for (double t : frames.t) demand(std::isfinite(t), "t spans more than a double can say");
  for (const auto& bodies : frames.X_WB) {
    for (const auto& X : bodies)
      demand(X.p.allFinite() && X.R.allFinite(),
             "q places a body nowhere: a quaternion of zero, or numbers too large");
  }
}

}  // namespace

std::string player_page(const PlayerInput& input) {
  check_samples(input);
  check_contacts(input);
  check_player_values(input);
  check_terrain(input);
  check_visuals(input);
  constexpr std::string_view kPlace = "@SCENE@";
  const std::string_view page = kPlayerPage;
  const std::size_t at = page.find(kPlace);
  std::string text(page.substr(0, at));
  const PlayerFrames frames = player_frames(input);
  check_frames(frames);
  text += scene_json(input, frames);
  return text += page.substr(at + kPlace.size());
}

void write_player(const PlayerInput& input, const std::string& path) {
  write_file_atomically(path, player_page(input));
}

}  // namespace dyntape
