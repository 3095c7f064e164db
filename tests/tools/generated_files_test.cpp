// SPDX-License-Identifier: BSD-3-Clause
//
// What generate leaves behind, for people and for build systems.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <tuple>

#include "interface/run/tied_robots.h"
#include "run.h"

namespace generated_files_test {
namespace {

using dyntape::test::config;
using dyntape::test::run_dyntape;
using dyntape::test::Scratch;
using dyntape::test::slurp;
using nlohmann::json;

mode_t permissions(const std::string& path) {
  struct stat status {};
  EXPECT_EQ(stat(path.c_str(), &status), 0) << path;
  return status.st_mode & 0777;
}

void generate(const std::string& folder, std::vector<std::string> more = {}) {
  std::vector<std::string> words = {
      "generate", config("robots/pendulum.urdf"), "--function", "rnea", "--order", "2", "--output", folder};
  words.insert(words.end(), more.begin(), more.end());
  const auto run = run_dyntape(words);
  ASSERT_EQ(run.status, 0) << run.err;
}

TEST(Generated, FilesHaveThePermissionsThatTheUserWants) {
  const Scratch scratch;
  const mode_t old = umask(022);
  generate(scratch / "open");
  umask(027);
  generate(scratch / "group");
  umask(old);
  for (const char* file : {"/pendulum_rnea.c", "/pendulum_rnea.h"}) {
    EXPECT_EQ(permissions(scratch / "open" + file), 0644u);
    EXPECT_EQ(permissions(scratch / "group" + file), 0640u);
  }
}

TEST(Generated, TheHeaderSaysWhatTheArraysHold) {
  const Scratch scratch;
  for (const bool embedded : {false, true}) {
    const std::string folder = scratch / (embedded ? "embedded" : "kernels");
    generate(folder, embedded ? std::vector<std::string>{"--embedded"} : std::vector<std::string>{});
    const std::string header = slurp(folder + "/pendulum_rnea.h");
    for (const char* part :
         {"x[3] variables: q0, v0, a0", "y[1] values: tau0", "jacobian[2]", "hessian[1]",
          "#define PENDULUM_RNEA_N_X 3\n", "#define PENDULUM_RNEA_N_Y 1\n", "#define PENDULUM_RNEA_N_W 1\n",
          "#define PENDULUM_RNEA_JACOBIAN_NNZ 2\n", "#define PENDULUM_RNEA_HESSIAN_NNZ 1\n"})
      EXPECT_NE(header.find(part), std::string::npos) << part << "\n" << header;
    EXPECT_EQ(header.find("_VALUE_WORK ") == std::string::npos, embedded) << header;
    EXPECT_EQ(header.find("#define PENDULUM_RNEA_DESCRIPTOR dyntape_") == std::string::npos, embedded)
        << header;
  }
}

// A program that knows no number and no name that a change of the robot would change.
TEST(Generated, AProgramNeedsTheHeaderAlone) {
  const Scratch scratch;
  generate(scratch / "c");
  std::ofstream(scratch / "c/main.c") <<
      R"(#include "pendulum_rnea.h"
int main(void) {
  double x[PENDULUM_RNEA_N_X] = {0}, y[PENDULUM_RNEA_N_Y], work[PENDULUM_RNEA_FIRST_ORDER_WORK + 1];
  double jacobian[PENDULUM_RNEA_JACOBIAN_NNZ];
  pendulum_rnea_first_order(x, 0, 0, y, jacobian, 0, work, 1, 0, 0);
  return PENDULUM_RNEA_DESCRIPTOR.x.size == PENDULUM_RNEA_N_X && y[0] == 0 ? 0 : 1;
}
)";
  const std::string folder = scratch / "c";
  const std::string build =
      "cd " + folder + " && cc -std=c99 -Wall -Wextra -Werror main.c pendulum_rnea.c -lm -o program";
  ASSERT_EQ(std::system(build.c_str()), 0);
  EXPECT_EQ(std::system((folder + "/program").c_str()), 0);
}

TEST(GeneratedFiles, KernelsOfDevices) {
  const Scratch scratch;
  const auto with = [&](const std::string& dialect, const std::vector<std::string>& more = {}) {
    std::vector<std::string> all = {"generate",   config("robots/double_pendulum.urdf"),
                                    "--function", "aba",
                                    "--order",    "1",
                                    "--output",   scratch / dialect,
                                    "--dialect",  dialect,
                                    "--json"};
    all.insert(all.end(), more.begin(), more.end());
    return run_dyntape(all);
  };
  for (const auto& [dialect, suffix, word, other] : {std::tuple("opencl", ".cl", "__kernel", "__global__"),
                                                     std::tuple("cuda", ".cu", "__global__", "__kernel")}) {
    const auto run = with(dialect);
    ASSERT_EQ(run.status, 0) << run.err;
    const json report = json::parse(run.out);
    ASSERT_EQ(report["kernels"].size(), 2u);
    EXPECT_EQ(report["kernels"][1]["in"], 6);
    const std::string path = report["files"][0];
    EXPECT_TRUE(path.ends_with(suffix)) << path;
    const std::string text = slurp(path);
    EXPECT_NE(text.find(word), std::string::npos);
    EXPECT_EQ(text.find(other), std::string::npos);
    EXPECT_NE(text.find("typedef double real"), std::string::npos);
    EXPECT_NE(slurp(report["files"][1].get<std::string>()).find("_JACOBIAN_NNZ "), std::string::npos);
  }
  const json single = json::parse(with("cuda", {"--float"}).out);
  EXPECT_NE(slurp(single["files"][0].get<std::string>()).find("typedef float real"), std::string::npos);
  EXPECT_EQ(with("cuda", {"--embedded"}).status, 2);
  EXPECT_EQ(with("metal").status, 2);
}

TEST(Generated, ControllersHaveIndependentJointsOnly) {
  const Scratch scratch;
  const dyntape::test::Sliders of;
  std::ofstream(scratch / "tied.urdf") << of.urdf();
  std::ofstream(scratch / "tied.info")
      << "robot { urdf tied.urdf  mimic true }\nhorizon { duration 1  intervals 10 }\n"
         "transcription { scheme runge-kutta-4  dynamics forward  hessian gauss_newton }\nstart { q { a 0 } "
         "}\ngoal { q { a 1 } }\n"
         "costs { control 0.1  tracking { q 10  v 1 } }\n";
  const auto made = run_dyntape({"generate", scratch / "tied.info", "--controller", scratch / "c", "--json"});
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_EQ(json::parse(made.out)["states"], 2);
}

// Of a task: two files that compile by themselves, or a refusal and none.
TEST(Generated, ControllersOfTasks) {
  const Scratch scratch;
  const std::string task = config("control/cart_pole_swings_up.info"), folder = scratch / "c";
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"generate", task, "--controller", folder, "--json"});
    return run_dyntape(more);
  };
  const json report = json::parse(with({"--float"}).out);
  EXPECT_LT(report["state_bytes"].get<int>(), 32000);
  EXPECT_GT(report["iteration"]["sum"].get<double>(), 1e5);
  const std::string build = "cd " + folder +
                            " && cc -std=c99 -Wall -Wextra -Wconversion -pedantic -Werror -O2 -c "
                            "cart_pole_swings_up.c -o c.o";
  EXPECT_EQ(std::system(build.c_str()), 0);
  std::filesystem::remove_all(folder);
  for (const auto& [set, part] : {std::pair("transcription.scheme=trapezoid", "trapezoid"),
                                  std::pair("transcription.dynamics=inverse", "inverse"),
                                  std::pair("transcription.hessian=exact", "gauss_newton")}) {
    const auto refused = with({"--set", set});
    EXPECT_EQ(refused.status, 1) << set;
    EXPECT_NE(refused.err.find(part), std::string::npos) << refused.err;
  }
  EXPECT_NE(with({"--target-bytes", "1000"}).err.find("1 000"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder));
  EXPECT_EQ(run_dyntape({"generate", task, "--controller", folder, "--function", "rnea"}).status, 2);
  EXPECT_EQ(run_dyntape({"generate", config("robots/ur5.urdf"), "--output", folder}).status, 2);
  for (const auto& [name, value] :
       {std::pair("--dialect", "opencl"), std::pair("--order", "2"), std::pair("--base", "floating")})
    EXPECT_EQ(with({name, value}).status, 2) << name;
  const auto without = run_dyntape({"generate", task, "--output", folder});
  EXPECT_EQ(without.status, 1);
  EXPECT_NE(without.err.find("--controller"), std::string::npos) << without.err;
  EXPECT_FALSE(std::filesystem::exists(folder));
  // A folder where the header goes: no text either.
  std::filesystem::create_directories(folder + "/cart_pole_swings_up.h");
  EXPECT_EQ(with({}).status, 1);
  EXPECT_FALSE(std::filesystem::exists(folder + "/cart_pole_swings_up.c"));
}

}  // namespace

}  // namespace generated_files_test
