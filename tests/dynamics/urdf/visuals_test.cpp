// SPDX-License-Identifier: BSD-3-Clause
//
// Visual shapes of URDF files: where they are, what is read from meshes, and what is said of bad ones.
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/model/model_operations.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/dynamics/urdf/visuals.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>

#include "source_folder.h"

namespace dyntape::dynamics::visuals_test {
namespace {

namespace fs = std::filesystem;

// A base and a link "arm" that turns about z at (1, 0, 0), with `visual` in the arm and `head` in the robot.
std::string robot_with(const std::string& visual, const std::string& head = "") {
  return "<robot name='r'>" + head +
         "<link name='base'/><joint name='j' type='continuous'><parent link='base'/><child link='arm'/>"
         "<origin xyz='1 0 0'/><axis xyz='0 0 1'/></joint><link name='arm'>" +
         visual + "</link></robot>";
}

std::string shape_of(const std::string& geometry, const std::string& rest = "") {
  return "<visual><geometry>" + geometry + "</geometry>" + rest + "</visual>";
}

UrdfVisuals visuals_of(const std::string& text, const std::string& file = "t.urdf",
                       const VisualOptions& options = {}) {
  return read_visuals_text(text, file, load_urdf_text(robot_with(""), "t.urdf"), options);
}

std::string note_of(const std::string& text) {
  const UrdfVisuals visuals = visuals_of(text);
  return visuals.notes.empty() ? "" : visuals.notes.front();
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != text.npos; }

TEST(Visuals, SizesColoursAndPlaces) {
  const UrdfVisuals v = visuals_of(robot_with(
      shape_of("<box size='1 2 3'/>",
               "<origin xyz='4 5 6' rpy='0 0 1.5707963267948966'/>"
               "<material name='red'/>") +
          shape_of("<cylinder radius='.1' length='.4'/>",
                   "<material name='own'><color rgba='.1 .2 .3 .4'/></material>") +
          shape_of("<sphere radius='.2'/>", "<material name='own'/>") + shape_of("<sphere radius='.3'/>"),
      "<material name='red'><color rgba='1 0 0 1'/></material>"));
  ASSERT_EQ(v.shapes.size(), 4u);
  EXPECT_EQ(v.shapes[0].shape, Shape::kBox);
  EXPECT_EQ(v.shapes[0].link, "arm");
  EXPECT_EQ(v.shapes[0].body, 0);
  EXPECT_EQ(v.shapes[0].scale, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(v.shapes[0].color, Eigen::Vector4d(1, 0, 0, 1));
  const Eigen::Vector3d corner = v.shapes[0].X_BV.R * Vector3<double>(1, 0, 0) + v.shapes[0].X_BV.p;
  EXPECT_LT((corner - Eigen::Vector3d(4, 6, 6)).norm(), 1e-15);
  EXPECT_EQ(v.shapes[1].shape, Shape::kCylinder);
  EXPECT_EQ(v.shapes[1].scale, Eigen::Vector3d(0.1, 0.1, 0.4));
  EXPECT_EQ(v.shapes[1].color, Eigen::Vector4d(.1, .2, .3, .4));
  EXPECT_EQ(v.shapes[2].color, v.shapes[1].color);
  EXPECT_EQ(v.shapes[2].scale, Eigen::Vector3d(0.2, 0.2, 0.2));
  EXPECT_FALSE(v.shapes[3].color);
  EXPECT_TRUE(v.notes.empty());
}

// A shape stands in the world where the frame of its link does, whatever base and locked joints.
TEST(Visuals, FollowTheirLinksThroughLockedJointsAndOtherBases) {
  const std::string text =
      robot_with(shape_of("<sphere radius='.2'/>", "<origin xyz='.1 .2 .3' rpy='.4 .5 .6'/>"));
  const Model<double> floating = load_urdf_text(text, "t.urdf", {.base = Base::kFloating});
  const Model<double> hung = change_base(floating, "arm", Base::kFixed);
  const Model<double> locked = lock_joints(floating, {"j"}, neutral(floating));
  const Placement<double> X_LV = read_visuals_text(text, "t.urdf", load_urdf_text(text, "t")).shapes[0].X_BV;
  std::mt19937_64 random(5);
  for (const Model<double>* model : {&floating, &hung, &locked}) {
    const Visual v = read_visuals_text(text, "t.urdf", *model).shapes.at(0);
    Data<double> data(*model);
    forward_kinematics<double>(*model, data, random_configuration(*model, random));
    const Placement<double> X_WL = frame_placement(*model, data, model->frame_index("arm"));
    const Placement<double> X_WV = v.body < 0 ? v.X_BV : data.X_WB[std::size_t(v.body)] * v.X_BV;
    EXPECT_LT(((X_WL * X_LV).p - X_WV.p).norm(), 1e-14);
    EXPECT_LT(((X_WL * X_LV).R - X_WV.R).norm(), 1e-14);
  }
}

TEST(Visuals, OfTheRobotsInTheRepository) {
  std::size_t shapes = 0;
  for (const auto& entry : fs::directory_iterator(test::source_folder() + "/config/robots")) {
    if (entry.path().extension() != ".urdf") continue;
    const UrdfVisuals v = read_visuals(entry.path(), load_urdf(entry.path()));
    EXPECT_TRUE(v.notes.empty()) << entry.path();
    EXPECT_TRUE(v.incomplete.empty()) << entry.path();
    for (const Visual& shape : v.shapes) EXPECT_GT(shape.scale.minCoeff(), 0) << entry.path();
    shapes += v.shapes.size();
  }
  EXPECT_GE(shapes, 9u);
}

TEST(Visuals, FaultsInOneSentenceWithTheirPlace) {
  const std::pair<std::string, std::string> cases[] = {
      {shape_of("<box/>"), "<box> has no size"},
      {shape_of("<box size='1 2'/>"), "expected 3 numbers"},
      {shape_of("<box size='1 -2 3'/>"), "lengths above zero"},
      {shape_of("<box size='1 x 3'/>"), "is not a number"},
      {shape_of("<sphere radius='nan'/>"), "nan"},
      {shape_of("<cylinder radius='1'/>"), "no length"},
      {shape_of("<cone radius='1'/>"), "expected <box>, <cylinder>, <sphere> or <mesh>"},
      {"<visual/>", "without a shape"},
      {shape_of("<mesh/>"), "no filename"},
      {shape_of("<mesh filename='a.stl' scale='1 0 1'/>"), "scale of zero"},
      {shape_of("<sphere radius='1'/>", "<material name='a'><color rgba='0 0 2 1'/></material>"), "0 to 1"},
      {shape_of("<sphere radius='1'/>", "<material name='a'><color/></material>"), "no rgba"},
      {shape_of("<sphere radius='1'/>", "<material name='readd'/>"), "did you mean 'red'"}};
  for (const auto& [visual, part] : cases) {
    const std::string said =
        note_of(robot_with(visual, "<material name='red'><color rgba='1 0 0 1'/></material>"));
    EXPECT_TRUE(said.starts_with("t.urdf:1: ")) << visual << "\n" << said;
    EXPECT_TRUE(contains(said, part)) << visual << "\n" << said;
  }
}

class Meshes : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  std::string file(const std::string& name, const std::string& text) const {
    write_file_atomically(folder_ / name, text);
    return folder_ / name;
  }
  UrdfVisuals with_mesh(const std::string& name, const std::string& attributes = "",
                        const VisualOptions& options = {}) const {
    const std::string mesh = "<mesh filename='" + name + "' " + attributes + "/>";
    return visuals_of(robot_with(shape_of(mesh)), folder_ / "my_robot/urdf/r.urdf", options);
  }
  fs::path folder_ = fs::temp_directory_path() / ("dyntape-visuals-test-" + std::to_string(::getpid()));
};

// Two triangles of a unit square in z = 0.
std::string ascii_stl() {
  const auto facet = [](const std::string& a, const std::string& b, const std::string& c) {
    return "facet normal 0 0 1\nouter loop\nvertex " + a + "\nvertex " + b + "\nvertex " + c +
           "\nendloop\nendfacet\n";
  };
  return "solid square\n" + facet("0 0 0", "1 0 0", "1 1 0") + facet("0 0 0", "1 1 0", "0 1 0") +
         "endsolid square\n";
}

std::string binary_stl() {
  std::string text(80, ' ');
  const auto put = [&](auto value) { text.append(reinterpret_cast<const char*>(&value), sizeof value); };
  put(std::uint32_t{2});
  const float corners[2][9] = {{0, 0, 0, 1, 0, 0, 1, 1, 0}, {0, 0, 0, 1, 1, 0, 0, 1, 0}};
  for (const auto& triangle : corners) {
    for (float x : {0.f, 0.f, 1.f}) put(x);
    for (float x : triangle) put(x);
    put(std::uint16_t{0});
  }
  return text;
}

// In millimetres, z called upwards, moved by a frame of the file, in a colour.
std::string collada() {
  return R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="0.001" name="millimeter"/><up_axis>Z_UP</up_axis></asset>
<library_effects><effect id="e"><profile_COMMON><technique sid="t"><lambert><diffuse><color>0.2 0.4 0.6 1</color>
</diffuse></lambert></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="m" name="blue"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count="12">
0 0 0 1000 0 0 1000 1000 0 0 1000 0</float_array><technique_common><accessor source="#a" count="4" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor>
</technique_common></source><vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="2" material="s"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2 0 2 3</p></triangles>
</mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node>
<translate>0 0 500</translate><instance_geometry url="#g"><bind_material><technique_common>
<instance_material symbol="s" target="#m"/></technique_common></bind_material></instance_geometry></node>
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
}

// Of all the triangles, twice the area as a vector, and the sum of the corners.
std::pair<Eigen::Vector3f, Eigen::Vector3f> area_and_sum(const Mesh& mesh) {
  Eigen::Vector3f area = Eigen::Vector3f::Zero(), sum = area;
  for (const auto& [i, j, k] : mesh.triangles) {
    const auto &a = mesh.vertices.at(i), &b = mesh.vertices.at(j), &c = mesh.vertices.at(k);
    area += (b - a).cross(c - a);
    sum += a + b + c;
  }
  return {area, sum};
}

TEST_F(Meshes, OfEveryKind) {
  fs::create_directories(folder_ / "my_robot/urdf");
  file("my_robot/urdf/a.stl", ascii_stl());
  file("my_robot/urdf/b.STL", binary_stl());
  file("my_robot/urdf/c.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n");
  file("my_robot/urdf/d.dae", collada());
  for (const char* name : {"a.stl", "b.STL", "c.obj", "d.dae"}) {
    const UrdfVisuals v = with_mesh(name, "scale='2 2 -2'");
    ASSERT_EQ(v.shapes.size(), 1u) << name << (v.notes.empty() ? "" : v.notes[0]);
    EXPECT_EQ(v.shapes[0].scale, Eigen::Vector3d(2, 2, -2));
    EXPECT_EQ(v.shapes[0].mesh->triangles.size(), 2u) << name;
    const auto [area, sum] = area_and_sum(*v.shapes[0].mesh);
    EXPECT_LT((area - Eigen::Vector3f(0, 0, 2)).norm(), 1e-6f) << name << "\n" << area;
    const float height = *name == 'd' ? 3 : 0;  // six corners at half a metre
    EXPECT_LT((sum - Eigen::Vector3f(3, 3, height)).norm(), 1e-6f) << name << "\n" << sum;
    EXPECT_EQ(v.shapes[0].color.has_value(), *name == 'd') << name;
  }
  EXPECT_LT((*with_mesh("d.dae").shapes[0].color - Eigen::Vector4d(.2, .4, .6, 1)).norm(), 1e-6);
}

TEST_F(Meshes, AreLookedForInPackages) {
  file("my_robot/meshes/a.stl", ascii_stl());
  file("other/meshes/b.stl", ascii_stl());
  file("far/away/third/c.stl", ascii_stl());
  fs::create_directories(folder_ / "my_robot/urdf");
  EXPECT_EQ(with_mesh("../meshes/a.stl").shapes.size(), 1u);
  EXPECT_EQ(with_mesh("file://" + (folder_ / "other/meshes/b.stl").string()).shapes.size(), 1u);
  EXPECT_EQ(with_mesh("package://my_robot/meshes/a.stl").shapes.size(), 1u);
  EXPECT_EQ(with_mesh("package://other/meshes/b.stl").shapes.size(), 1u);
  EXPECT_EQ(with_mesh("package://third/c.stl").shapes.size(), 0u);
  for (const std::string paths : {folder_ / "far/away", folder_ / "far/away/third/"}) {
    ::setenv("ROS_PACKAGE_PATH", ("/nowhere::" + paths).c_str(), 1);
    EXPECT_EQ(with_mesh("package://third/c.stl").shapes.size(), 1u) << paths;
  }
  ::unsetenv("ROS_PACKAGE_PATH");
}

TEST_F(Meshes, ThatCannotBeReadAreNotes) {
  fs::create_directories(folder_ / "my_robot/urdf");
  file("my_robot/urdf/bad.stl", "solid nothing\nendsolid nothing\n");
  file("my_robot/urdf/cut.stl", binary_stl().substr(0, 120));
  file("my_robot/urdf/odd.step", "ISO-10303-21;");
  file("my_robot/urdf/nan.obj", "v nan 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n");
  for (const char* name : {"none.stl", "bad.stl", "cut.stl", "odd.step", "nan.obj", "package://x", "."}) {
    const UrdfVisuals v = with_mesh(name);
    EXPECT_EQ(v.shapes.size(), 0u) << name;
    ASSERT_EQ(v.notes.size(), 1u) << name;
    EXPECT_TRUE(contains(v.notes[0], "r.urdf:1: link \"arm\": ")) << v.notes[0];
    EXPECT_EQ(v.incomplete, (std::vector<std::string>{"arm"}));
  }
}

TEST_F(Meshes, KeepALimitOnTriangles) {
  file("my_robot/urdf/a.stl", ascii_stl());
  const std::string twice = shape_of("<mesh filename='a.stl'/>") + shape_of("<mesh filename='./a.stl'/>");
  const UrdfVisuals all = visuals_of(robot_with(twice), folder_ / "my_robot/urdf/r.urdf", {4});
  ASSERT_EQ(all.shapes.size(), 2u);
  EXPECT_EQ(all.shapes[0].mesh, all.shapes[1].mesh);  // read once
  const UrdfVisuals some = visuals_of(robot_with(twice), folder_ / "my_robot/urdf/r.urdf", {3});
  EXPECT_EQ(some.shapes.size(), 1u);
  ASSERT_EQ(some.notes.size(), 1u);
  EXPECT_TRUE(contains(some.notes[0], "of 2 triangles is left out; expected at most 3")) << some.notes[0];
}

// What a mesh names is read where it is a regular file of its own surroundings; nothing is waited for.
TEST_F(Meshes, NameFilesOfTheirOwnSurroundings) {
  const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl red\nf 1 2 3 4\n";
  const std::string red = "newmtl red\nKd 1 0 0\n";
  fs::create_directories(folder_ / "my_robot/urdf");
  file("my_robot/meshes/beside.mtl", red);
  file("my_robot/urdf/robots.mtl", red);
  file("my_robot/materials/packages.mtl", red);
  file("secret/else.mtl", red);
  fs::create_directory_symlink(folder_ / "secret", folder_ / "my_robot/meshes/link");
  ASSERT_EQ(mkfifo((folder_ / "my_robot/meshes/pipe.mtl").c_str(), 0600), 0);
  const auto coloured = [&](const std::string& material) {
    file("my_robot/meshes/a.obj", "mtllib " + material + "\n" + square);
    const UrdfVisuals v = with_mesh("../meshes/a.obj");
    EXPECT_EQ(v.shapes.size(), 1u) << material;
    const bool has_colour =
        v.shapes.size() == 1 && v.shapes[0].color && v.shapes[0].color->isApprox(Eigen::Vector4d(1, 0, 0, 1));
    if (!has_colour && material != "none.mtl" && material[0] != '/') {  // none of these is looked for
      EXPECT_EQ(v.notes.size(), 1u) << material;
      if (!v.notes.empty()) {
        EXPECT_TRUE(contains(v.notes[0], "is left out: it is no regular file below")) << v.notes[0];
      }
    }
    return has_colour;
  };
  EXPECT_TRUE(coloured("beside.mtl"));
  EXPECT_TRUE(coloured("../urdf/robots.mtl"));
  EXPECT_FALSE(coloured("../materials/packages.mtl"));
  file("my_robot/package.xml", "<package/>");
  EXPECT_TRUE(coloured("../materials/packages.mtl"));
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_FALSE(coloured("pipe.mtl"));
  EXPECT_FALSE(coloured("../../secret/else.mtl"));
  EXPECT_FALSE(coloured("link/else.mtl"));
  EXPECT_FALSE(coloured((folder_ / "secret/else.mtl").string()));
  EXPECT_FALSE(coloured("/dev/zero"));
  EXPECT_FALSE(coloured("none.mtl"));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(2));
}

std::string polygon_of(int corners) {
  std::string text;
  for (int k = 0; k < corners; ++k) {
    const double r = k % 2 ? 1 : 2, angle = 2 * M_PI * k / corners;  // a star: no fan cuts it
    text += "v " + std::to_string(r * std::cos(angle)) + " " + std::to_string(r * std::sin(angle)) + " 0\n";
  }
  text += "f";
  for (int k = 1; k <= corners; ++k) text += (k % 100 == 0 ? " \\\n " : " ") + std::to_string(k);
  return text + "\n";
}

std::string large_binary_stl(std::uint32_t triangles) {
  std::string text(84 + std::size_t(triangles) * 50, '\0');
  std::memcpy(text.data() + 80, &triangles, sizeof triangles);
  return text;
}

std::string large_ascii_stl(int triangles) {
  std::string text = "solid s\n";
  for (int k = 0; k < triangles; ++k)
    text += "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nendloop\nendfacet\n";
  return text + "endsolid s\n";
}

// 2000 copies of a square of a thousand: 2 million triangles of a small file.
std::string many_copies() {
  std::string text = collada(), p;
  for (int k = 0; k < 500; ++k) p += "0 1 2 0 2 3 ";
  text.replace(text.find("<p>0 1 2 0 2 3"), 14, "<p>" + p);
  text.replace(text.find("<triangles count=\"2\""), 20, "<triangles count=\"1000\"");
  const std::size_t begin = text.find("<node>"), end = text.find("</node>") + 7;
  const std::string node = text.substr(begin, end - begin);
  std::string nodes;
  for (int k = 0; k < 2000; ++k) nodes += node;
  return text.replace(begin, end - begin, nodes);
}

TEST_F(Meshes, AreCountedBeforeTheyCost) {
  fs::create_directories(folder_ / "my_robot/urdf");
  std::string faces = "v 0 0 0\nv 1 0 0\nv 1 1 0\n";
  for (int k = 0; k < 400000; ++k) faces += "f 1 2 3\n";
  const std::pair<std::string, std::string> cases[] = {{"star.obj", polygon_of(20000)},
                                                       {"large.stl", large_binary_stl(2'000'000)},
                                                       {"ascii.stl", large_ascii_stl(400'000)},
                                                       {"faces.obj", faces},
                                                       {"copies.dae", many_copies()}};
  for (const auto& [name, text] : cases) {
    std::ofstream(folder_ / "my_robot/urdf" / name, std::ios::binary) << text;
    const auto begin = std::chrono::steady_clock::now();
    const UrdfVisuals v = with_mesh(name);
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(3)) << name;
    EXPECT_EQ(v.shapes.size(), 0u) << name;
    ASSERT_EQ(v.notes.size(), 1u) << name;
    EXPECT_TRUE(contains(v.notes[0], "is left out")) << v.notes[0];
  }
  // What has some more corners is still cut.
  std::ofstream(folder_ / "my_robot/urdf/small.obj") << polygon_of(60);
  const UrdfVisuals small = with_mesh("small.obj");
  ASSERT_EQ(small.shapes.size(), 1u);
  EXPECT_EQ(small.shapes[0].mesh->triangles.size(), 58u);
}

TEST_F(Meshes, AreLeftOutWhereSomebodyStopsTheReading) {
  file("my_robot/urdf/a.stl", ascii_stl());
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(with_mesh("a.stl", "", {.stop = stop.get_token()}).shapes.size(), 0u);
  EXPECT_EQ(with_mesh("a.stl").shapes.size(), 1u);
}

}  // namespace
}  // namespace dyntape::dynamics::visuals_test
