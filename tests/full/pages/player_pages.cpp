// SPDX-License-Identifier: BSD-3-Clause
//
// Pages that a browser is to play (player.py): player_pages ROBOTS_FOLDER OUTPUT_FOLDER
#include <cmath>
#include <iostream>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/report/player/player.h>

namespace {

using namespace dyntape;
using namespace dyntape::dynamics;

struct Robot {
  std::string file, name;
  Base base;
};

PlayerInput input_of(const std::string& folder, const Robot& robot, double seconds) {
  PlayerInput input{.title = robot.name, .model = load_urdf(folder + robot.file, {.base = robot.base})};
  input.visuals = read_visuals(folder + robot.file, input.model);
  input.t = Eigen::VectorXd::LinSpaced(int(100 * seconds) + 1, 0, seconds);
  input.q = neutral(input.model).replicate(1, input.t.size());
  return input;
}

void turn(PlayerInput& input, const std::string& joint, double mean, double swing, double phase) {
  const int at = input.model.joints[std::size_t(input.model.joint_index(joint))].idx_q;
  input.q.row(at) = (mean + swing * (2 * M_PI * input.t.array() + phase).sin()).matrix().transpose();
}

double weight(const Model<double>& model) {
  double mass = 0;
  for (const auto& inertia : model.inertias) mass += inertia.mass;
  return mass * 9.81;
}

PlayerInput pendulum(const std::string& folder) {
  PlayerInput input = input_of(folder, {"pendulum.urdf", "pendulum", Base::kFixed}, 2);
  turn(input, "hinge", 0, 1, M_PI / 2);
  input.traces = {"tip"};
  return input;
}

// Stands, and moves up and down; its weight on four feet.
PlayerInput dog(const std::string& folder) {
  PlayerInput input = input_of(folder, {"solo12.urdf", "solo12", Base::kFloating}, 2);
  for (const std::string leg : {"FL", "FR", "HL", "HR"}) {
    const double sign = leg[0] == 'F' ? 1 : -1;
    turn(input, leg + "_HFE", 0.8 * sign, 0.2 * sign, 0);
    turn(input, leg + "_KFE", -1.6 * sign, -0.4 * sign, 0);
  }
  Data<double> data(input.model);
  for (int k = 0; k < input.t.size(); ++k) {
    std::vector<PlayerContact> feet;
    for (const std::string leg : {"FL", "FR", "HL", "HR"}) {
      forward_kinematics<double>(input.model, data, input.q.col(k));
      const auto X = frame_placement(input.model, data, input.model.frame_index(leg + "_FOOT"));
      if (feet.empty()) input.q(2, k) -= X.p.z();  // the feet on the ground
      feet.push_back({{X.p.x(), X.p.y(), 0}, {0, 0, weight(input.model) / 4}});
    }
    input.contacts.push_back(feet);
  }
  input.plane = PlayerPlane{};
  input.values = {{"height", "m", input.q.row(2).transpose()}};
  return input;
}

// Walks away as a stiff figure: what the camera follows.
PlayerInput humanoid(const std::string& folder) {
  PlayerInput input = input_of(folder, {"simple_humanoid.urdf", "simple_humanoid", Base::kFloating}, 10);
  for (int k = 0; k < input.t.size(); ++k) {
    std::mt19937_64 random(7);
    const Eigen::VectorXd q = random_configuration(input.model, random);
    Eigen::VectorXd to_q = difference<double>(input.model, input.q.col(k), q);
    to_q.head(6).setZero();
    input.q.col(k) = integrate<double>(input.model, input.q.col(k), to_q * (0.2 * std::sin(5 * input.t[k])));
    input.q(0, k) = input.t[k];
  }
  input.traces = {input.model.frames.back().name};
  return input;
}

PlayerInput hills(const std::string& folder) {
  PlayerInput input = input_of(folder, {"solo12.urdf", "hills", Base::kFloating}, 1);
  input.q.row(0) = 0.5 * input.t.transpose();
  PlayerHeights heights{{-1, -1}, {0.1, 0.1}, Eigen::MatrixXd(26, 21)};
  for (int i = 0; i < 26; ++i) {
    for (int j = 0; j < 21; ++j) heights.heights(i, j) = -0.4 + 0.05 * std::sin(0.8 * i) * std::cos(0.7 * j);
  }
  input.heights = heights;
  return input;
}

// A gear wheel as a mesh, mirrored and stretched beside itself, and one that is not there.
PlayerInput meshes(const std::string& out) {
  constexpr int kTeeth = 12;
  std::string obj, faces;
  for (int i = 0; i < 4 * kTeeth; ++i) {
    const double angle = 2 * M_PI * i / (4 * kTeeth), r = i % 4 < 2 ? 1.0 : 0.8;
    for (double z : {-0.2, 0.2})
      obj += "v " + std::to_string(r * std::cos(angle)) + " " + std::to_string(r * std::sin(angle)) + " " +
             std::to_string(z) + "\n";
    const auto vertex = [&](int k) { return " " + std::to_string((2 * i + k) % (8 * kTeeth) + 1); };
    faces += "f" + vertex(0) + vertex(2) + vertex(3) + vertex(1) + "\n";
    for (int side : {0, 1})
      faces += "f" + vertex(side) + vertex(2 + side) + " " + std::to_string(8 * kTeeth + 1 + side) + "\n";
  }
  write_file_atomically(out + "gear.obj", obj + "v 0 0 -0.2\nv 0 0 0.2\n" + faces);
  const auto link = [](const std::string& name, const std::string& mesh, const std::string& color) {
    return "<link name='" + name + "'><visual><geometry><mesh filename='" + mesh +
           "'/></geometry><material name='" + name + "'><color rgba='" + color +
           "'/></material></visual></link>";
  };
  const auto joint = [](const std::string& parent, const std::string& child, const std::string& xyz) {
    return "<joint name='to_" + child + "' type='continuous'><parent link='" + parent + "'/><child link='" +
           child + "'/><origin xyz='" + xyz + "'/><axis xyz='0 0 1'/></joint>";
  };
  const std::string text = "<robot name='gears'><link name='base'/>" + joint("base", "one", "0 0 0.2") +
                           link("one", "gear.obj' scale='1 1 1", ".9 .6 .2 1") +
                           joint("base", "two", "1.9 0 0.2") +
                           link("two", "gear.obj' scale='-1 1 2", ".2 .6 .9 .6") +
                           joint("two", "three", "0 0 1") + link("three", "none.stl", "1 0 0 1") + "</robot>";
  PlayerInput input{
      .title = "meshes",
      .model = load_urdf_text(text, out + "gears.urdf", {.continuous = ContinuousJoint::kAngle})};
  input.visuals = read_visuals_text(text, out + "gears.urdf", input.model);
  input.t = Eigen::VectorXd::LinSpaced(61, 0, 1);
  input.q = Eigen::Vector3d(1, -1, 2) * input.t.transpose();
  return input;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::cerr << "player_pages ROBOTS_FOLDER OUTPUT_FOLDER\n";
    return 2;
  }
  const std::string robots = std::string(argv[1]) + "/", out = std::string(argv[2]) + "/";
  write_player(pendulum(robots), out + "pendulum.html");
  write_player(dog(robots), out + "dog.html");
  write_player(humanoid(robots), out + "humanoid.html");
  write_player(hills(robots), out + "hills.html");
  write_player(meshes(out), out + "meshes.html");
  return 0;
} catch (const dyntape::Error& e) {
  std::cerr << e.what() << "\n";
  return 1;
}
