// SPDX-License-Identifier: BSD-3-Clause
//
// Typed reading: what is accepted, and what is reported.
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/suggest.h>
#include <dyntape/interface/files/info/section.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <ctime>
#include <functional>
#include <random>

namespace dyntape::io::io_section_test {
namespace {

// Reads `text` with `questions` and returns what finish() reports, "" if nothing.
std::string report(const std::string& text, const std::function<void(Section&)>& questions) {
  Section file = Section::parse(text, "t.info");
  questions(file);
  try {
    file.finish();
  } catch (const FileError& error) {
    return error.what();
  }
  return "";
}

void expect_contains(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << "expected: " << part << "\ngot: " << text;
}

// The questions of a reader, whatever they hang upon, without a file.
TEST(Section, lists_the_questions) {
  Section file = Section::catalogue();
  Section mesh = file.about("the grid").child_or_empty("mesh");
  EXPECT_EQ(mesh.about("of equal length").get<int>("intervals", at_least(1)), 0);
  EXPECT_EQ(mesh.about("between points [s]").get_or("step", 0.05, positive()), 0.05);
  mesh.choice_or<int>("kind", "b", {{"a", 1}, {"b", 2}});
  if (file.about("where known").has("expected")) file.child("expected").get<double>("cost");
  file.about("by joint").defer("q", "a number a joint");
  mesh.get<int>("intervals");
  EXPECT_NO_THROW(file.finish());
  std::string text;
  for (const Question& q : file.questions())
    text +=
        q.path + "|" + q.takes + "|" + q.fallback + "|" + (q.is_required ? "!" : "") + "|" + q.meaning + "\n";
  EXPECT_EQ(text,
            "mesh|a block|||the grid\n"
            "mesh.intervals|a whole number, at least 1||!|of equal length\n"
            "mesh.step|a number, positive|0.05||between points [s]\n"
            "mesh.kind|a | b|b||\n"
            "expected|a block|||where known\n"
            "expected.cost|a number||!|\n"
            "q|a number a joint||!|by joint\n");
}

TEST(Section, what_is_deferred_is_known_and_may_be_missing) {
  const auto ask = [](Section& file) { file.defer("q", "numbers"), file.defer("v", "numbers", "0"); };
  EXPECT_EQ(report("q { a 1 }\nv 2\n", ask), "");
  EXPECT_EQ(report("q { a 1 }\n", ask), "");
  expect_contains(report("v 2\n", ask), "required key 'q' is missing");
  expect_contains(report("q 1\nq 2\n", ask), "duplicate key 'q'");
}

TEST(Section, soundness_is_known_before_the_end) {
  Section good = Section::parse("a 1\n", "t.info"), odd = Section::parse("a 1\nb 2\n", "t.info"),
          wrong = Section::parse("a x\n", "t.info");
  for (Section* file : {&good, &odd, &wrong}) file->get<int>("a");
  EXPECT_TRUE(good.sound());
  EXPECT_FALSE(odd.sound());
  EXPECT_FALSE(wrong.sound());
}

TEST(Section, reads_every_type) {
  Section s = Section::parse("d -1.5e-3\ni -7\nu 7\nl 4000000000\nb on\nn \"left arm\"\np +2\n", "t.info");
  EXPECT_EQ(s.get<double>("d"), -1.5e-3);
  EXPECT_EQ(s.get<int>("i"), -7);
  EXPECT_EQ(s.get<unsigned>("u"), 7u);
  EXPECT_EQ(s.get<long>("l"), 4000000000l);
  EXPECT_EQ(s.get<bool>("b"), true);
  EXPECT_EQ(s.get<std::string>("n"), "left arm");
  EXPECT_EQ(s.get<double>("p"), 2);
  EXPECT_EQ(s.get_or("absent", 3), 3);
  EXPECT_EQ(s.get_or("absent_text", "x"), "x");
  EXPECT_NO_THROW(s.finish());
}

TEST(Section, wrong_types_are_reported_where_the_value_stands) {
  const auto ask = [](auto sample) { return [=](Section& s) { s.get<decltype(sample)>("k"); }; };
  expect_contains(report("k 1e-3x", ask(0.0)), "t.info:1:3: 'k' expects a number, got '1e-3x'");
  expect_contains(report("k 3.7", ask(0)), "t.info:1:3: 'k' expects a whole number, got '3.7'");
  expect_contains(report("k -1", ask(0u)), "expects a whole number without sign, got '-1'");
  expect_contains(report("k True", ask(true)), "expects true or false, got 'True'");
  expect_contains(report("k nan", ask(0.0)), "must be finite, got 'nan'");
  expect_contains(report("k inf", ask(0.0)), "must be finite, got 'inf'");
  expect_contains(report("k 1e999", ask(0.0)), "expects a number in the range of a double, got '1e999'");
  expect_contains(report("k 3000000000", ask(0)), "expects a whole number, got '3000000000'");
  expect_contains(report("k 0x10", ask(0)), "expects a whole number, got '0x10'");
  expect_contains(report("k 1,5", ask(0.0)), "expects a number, got '1,5'");
  expect_contains(report("k +-1", ask(0.0)), "expects a number, got '+-1'");
  expect_contains(report("k", ask(0.0)), "t.info:1:1: 'k' has no value");
  expect_contains(report("k {\n}", ask(0.0)), "t.info:1:1: 'k' is a value, but a block was written");
  expect_contains(report("", ask(0.0)), "t.info: required key 'k' is missing");
}

TEST(Section, ranges_are_checked) {
  const auto ask = [](const Range& range) { return [=](Section& s) { s.get<double>("k", range); }; };
  expect_contains(report("k 0", ask(positive())), "'k' must be positive, got '0'");
  EXPECT_EQ(report("k 1e-300", ask(positive())), "");
  EXPECT_EQ(report("k 0", ask(not_negative())), "");
  expect_contains(report("k 0.5", ask(at_least(1))), "'k' must be at least 1, got '0.5'");
  expect_contains(report("k 1.5", ask(between(0, 1))), "'k' must be between 0 and 1, got '1.5'");
  EXPECT_EQ(report("k inf", ask(or_infinite(positive()))), "");
  expect_contains(report("k -inf", ask(or_infinite(positive()))), "must be positive or infinite, got '-inf'");
}

TEST(Section, APartOfAKeyIsMeantForIt) {
  const std::string said = report("effects\n{\n  damping 0.1\n}\n", [](Section& file) {
    Section effects = file.child("effects");
    effects.get_or("joint_damping", 0.0);
    effects.get_or("friction", 0.0);
  });
  EXPECT_EQ(said, "t.info:3:3: unknown key 'damping' in 'effects'; did you mean 'joint_damping'?");
}

TEST(Section, unknown_keys_get_the_nearest_name) {
  const std::string text = "solver\n{\n  maxIterationz 5\n  Tolerance 1e-3\n  friction 1\n}\nqqqqqq 1\n";
  const std::string said = report(text, [](Section& file) {
    Section solver = file.child("solver");
    solver.get_or("maxIterations", 5);
    solver.get_or("tolerance", 1.0);
    file.child_or_empty("effects").get_or("friction", 0.0);
  });
  EXPECT_EQ(said,
            "t.info:3:3: unknown key 'maxIterationz' in 'solver'; did you mean 'maxIterations'?\n"
            "t.info:4:3: unknown key 'Tolerance' in 'solver'; did you mean 'tolerance'?\n"
            "t.info:5:3: unknown key 'friction' in 'solver'; it belongs in 'effects'\n"
            "t.info:7:1: unknown key 'qqqqqq'; valid are 'solver', 'effects'");
}

// A key of two blocks was said to belong in one of them; one of another block of the same name, in its own block.
TEST(Section, KeysOfOtherBlocks) {
  const std::string text =
      "costs { duration 1 }\nvalue { kind grid steps 3 }\nvalue { kind normal steps 3 }\n";
  const std::string said = report(text, [](Section& file) {
    for (const char* block : {"horizon", "mpc"}) file.child_or_empty(block).get_or("duration", 1.0);
    file.child("costs").get_or("effort", 1.0);
    for (Section& value : file.children("value"))
      if (value.get<std::string>("kind") == "grid") value.get<int>("steps");
  });
  EXPECT_EQ(said,
            "t.info:1:9: unknown key 'duration' in 'costs'; it belongs in 'horizon' or in 'mpc'\n"
            "t.info:3:21: unknown key 'steps' in 'value'; valid are 'kind'");
}

TEST(Section, AMisspeltRequiredKeyIsOneProblem) {
  const std::string said = report("horizon {\n  duratoin 2\n}\n", [](Section& file) {
    Section horizon = file.child("horizon");
    horizon.get<double>("duration");
    horizon.get<double>("intervals");
  });
  EXPECT_EQ(said,
            "t.info:1:1: required key 'horizon.intervals' is missing\n"
            "t.info:2:3: unknown key 'duratoin' in 'horizon'; did you mean 'duration'?");
}

// Nor are the keys of a block whose name is misspelt, or that is a value, or missing.
TEST(Section, AMisspeltRequiredBlockIsOneProblem) {
  const auto ask = [](Section& file) {
    Section horizon = file.child("horizon");
    horizon.get<double>("duration");
    horizon.child("mesh").get<int>("intervals");
  };
  EXPECT_EQ(report("horizn {\n  duration 2\n}\n", ask),
            "t.info:1:1: unknown key 'horizn'; did you mean 'horizon'?");
  EXPECT_EQ(
      report("other 2\n", ask),
      "t.info:1:1: unknown key 'other'; valid are 'horizon'\nt.info: required key 'horizon' is missing");
  EXPECT_EQ(report("horizon 3\n", ask).find("missing"), std::string::npos);
  EXPECT_EQ(report("horizon {\n  duration 1\n}\n", ask),
            "t.info:1:1: required key 'horizon.mesh' is missing");
}

TEST(Section, problems_of_form_and_meaning_are_reported_together) {
  const std::string said = report("a 1x\nb 2 // two\nb 3\nc = 4\n", [](Section& s) {
    s.get<double>("a");
    EXPECT_EQ(s.get<double>("b"), 2);
    EXPECT_EQ(s.get<double>("c"), 4);
    s.get<double>("d");
  });
  EXPECT_TRUE(said.starts_with("t.info:1:3: 'a' expects a number, got '1x'\n")) << said;
  EXPECT_TRUE(said.ends_with("\nt.info: required key 'd' is missing")) << said;
  expect_contains(said, "t.info:2:5: '//' does not start a comment");
  expect_contains(said, "t.info:3:1: duplicate key 'b'; it is given first at t.info:2:1");
  expect_contains(said, "t.info:4:3: '=' would be the value");
}

TEST(Section, choices_name_the_valid_ones) {
  enum class Color { kRed, kBlue };
  const std::vector<std::pair<std::string, Color>> names = {{"red", Color::kRed}, {"blue", Color::kBlue}};
  EXPECT_EQ(Section::parse("k blue", "t").choice_or<Color>("k", "red", names), Color::kBlue);
  EXPECT_EQ(Section::parse("", "t").choice_or<Color>("k", "blue", names), Color::kBlue);
  expect_contains(report("k bleu", [&](Section& s) { s.choice_or<Color>("k", "red", names); }),
                  "t.info:1:3: 'k' cannot be 'bleu'; did you mean 'blue'?");
  expect_contains(report("k green-ish", [&](Section& s) { s.choice_or<Color>("k", "red", names); }),
                  "cannot be 'green-ish'; valid are 'red', 'blue'");
}

TEST(Section, names_in_every_spelling) {
  for (const char* text : {"k\n{\n[0] a\n[1] b\n}", "k \"a b\"", "k \"a, b\""}) {
    Section s = Section::parse(text, "t.info");
    EXPECT_EQ(s.strings_or("k", {}), (std::vector<std::string>{"a", "b"})) << text;
    EXPECT_NO_THROW(s.finish());
  }
  const auto ask = [](Section& s) { s.strings_or("k", {}); };
  expect_contains(report("k\n{\n[0] 1\n[2] 2\n}", ask), "t.info:4:1: '[2]' is out of place in the list 'k'");
  expect_contains(report("k\n{\n[0] 1\n[1] 2\n[1] 3\n}", ask), "t.info:5:1: duplicate entry '[1]' in 'k'");
}

TEST(Section, repeated_and_free_names) {
  Section s =
      Section::parse("term effort {\n w 1\n}\nterm time {\n w 2\n}\njoints {\n a 1\n b 2\n}", "t.info");
  std::vector<Section> terms = s.children("term");
  ASSERT_EQ(terms.size(), 2u);
  EXPECT_EQ(terms[1].value(), "time");
  EXPECT_EQ(terms[0].value() + terms[1].path(), "effortterm");
  EXPECT_EQ(terms[0].get<double>("w") + terms[1].get<double>("w"), 3);
  std::string names;
  Section joints = s.child("joints");
  for (Section& joint : joints.all_children()) names += joint.name() + joint.value();
  EXPECT_EQ(names, "a1b2");
  EXPECT_NO_THROW(s.finish());
  EXPECT_EQ(s.effective_values(),
            "term effort\n{\n  w 1\n}\nterm time\n{\n  w 2\n}\njoints\n{\n  a 1\n  b 2\n}\n");
}

TEST(Section, effective_values_read_back_and_mark_defaults) {
  const auto questions = [](Section& s) {
    Section solver = s.child_or_empty("solver");
    solver.get_or("tolerance", 0.1);
    solver.get_or("label", "two words");
    s.child_or_empty("rollout").get_or("steps", 4u);
    s.strings_or("driven", {});
    s.strings_or("locked", {"a", "b"});
  };
  Section first = Section::parse("solver\n{\n tolerance 1e-8\n}\ndriven \"c d\"\n", "t.info");
  questions(first);
  first.finish();
  const std::string text = first.effective_values();
  expect_contains(text, "  tolerance 1e-08\n  label     \"two words\"  ; default\n");
  Section second = Section::parse(text, "again.info");
  questions(second);
  EXPECT_NO_THROW(second.finish()) << text;
  expect_contains(second.effective_values(), "  tolerance 1e-08\n  label     \"two words\"\n");
}

// Whatever a double is, the dump gives it back.
TEST(Section, dumped_numbers_keep_every_bit) {
  std::mt19937_64 random(7);
  for (int i = 0; i < 2000; ++i) {
    const double value = std::bit_cast<double>(static_cast<std::uint64_t>(random()));
    if (!std::isfinite(value)) continue;
    Section s = Section::parse("", "t.info");
    s.get_or("k", value);
    Section again = Section::parse(s.effective_values(), "t.info");
    ASSERT_EQ(std::bit_cast<std::uint64_t>(again.get<double>("k")), std::bit_cast<std::uint64_t>(value));
  }
}

TEST(Section, a_question_that_no_file_can_answer_is_refused) {
  Section s = Section::parse("barrierReductionCostTol 1e-3", "t.info");
  EXPECT_THROW(s.get_or("barrierReductionCostTol ", 1e-2), ArgumentError);
}

// The defects that shipped configuration files are known to have, one small file each.
TEST(SectionCorpus, a_key_read_under_another_name) {
  const std::string said = report("ipm\n{\n  barrierReductionCostTol 1e-3\n}\n", [](Section& s) {
    EXPECT_EQ(s.child("ipm").get_or("barrierReductionCostTolerance", 1e-2), 1e-2);
  });
  expect_contains(said,
                  "t.info:3:3: unknown key 'barrierReductionCostTol' in 'ipm'; did you mean "
                  "'barrierReductionCostTolerance'?");
}

TEST(SectionCorpus, keys_that_nobody_reads_any_more) {
  const std::string text =
      "swing\n{\n  liftOffVelocity 0.2\n  touchdownAfterHorizon 0.2\n}\n"
      "ddp\n{\n  maxNumIterations 10\n  inequalityConstraintMu 0.1\n  debugCaching 0\n}\n"
      "rollout\n{\n  timeStep 1e-2\n  minTimeStep 1e-3\n}\nsubsystemsSequence\n{\n  [0] 0\n}\n";
  const std::string said = report(text, [](Section& s) {
    s.child("swing").get<double>("liftOffVelocity");
    s.child("ddp").get<int>("maxNumIterations");
    s.child("rollout").get<double>("timeStep");
  });
  for (const char* part : {"t.info:4:3: unknown key 'touchdownAfterHorizon' in 'swing'",
                           "t.info:9:3: unknown key 'inequalityConstraintMu' in 'ddp'",
                           "t.info:10:3: unknown key 'debugCaching' in 'ddp'",
                           "t.info:15:3: unknown key 'minTimeStep' in 'rollout'",
                           "t.info:17:1: unknown key 'subsystemsSequence'"}) {
    expect_contains(said, part);
  }
}

TEST(SectionCorpus, a_required_key_that_is_absent) {
  const std::string said = report("mpc\n{\n  timeHorizon 1\n}\n", [](Section& s) {
    s.child("mpc").get<double>("timeHorizon");
    s.child("mpc").get<int>("numPartitions");
  });
  EXPECT_EQ(said, "t.info:1:1: required key 'mpc.numPartitions' is missing");
}

TEST(SectionCorpus, names_that_do_not_exist) {
  const std::string said = report(
      "model_information\n{\n  removeJoints\n  {\n    [0] \"wheel_left\"\n    [1] \"head_tlit\"\n  }\n}\n",
      [](Section& s) {
        s.child("model_information")
            .strings_or("removeJoints", {}, {"wheel_left", "wheel_right", "head_tilt"});
      });
  EXPECT_EQ(said,
            "t.info:6:9: 'model_information.removeJoints' names 'head_tlit', which is unknown; did you mean "
            "'head_tilt'?");
}

TEST(SectionCorpus, slashes_taken_for_a_comment) {
  expect_contains(report("Q\n{\n  (0,0) 15.0   // Body position\n}\n",
                         [](Section& s) { s.child("Q").get<double>("(0,0)"); }),
                  "t.info:3:16: '//' does not start a comment");
}

// A list, blocks of one name and unknown keys, n of each.
double seconds_of_settings(int n) {
  std::string text = "list\n{\n", unknown;
  for (int i = 0; i < n; ++i) text += "[" + std::to_string(i) + "] name" + std::to_string(i) + "\n";
  text += "}\n";
  for (int i = 0; i < n; ++i) text += "block\n{\nvalue 1.5\n}\nunknown" + std::to_string(i) + " 1\n";
  const std::clock_t start = std::clock();
  Section s = Section::parse(text, "t.info");
  EXPECT_EQ(s.strings_or("list", {}).size(), static_cast<size_t>(n));
  for (Section& block : s.children("block")) EXPECT_EQ(block.get<double>("value"), 1.5);
  EXPECT_FALSE(s.effective_values().empty());
  EXPECT_THROW(s.finish(), FileError);
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

TEST(Section, long_files_take_linear_time) {
  const double some = seconds_of_settings(6000);
  EXPECT_LT(seconds_of_settings(24000), 10 * some + 0.2);
}

TEST(Section, places_are_of_keys_or_of_the_blocks_around_them) {
  const Places places =
      Section::parse("start\n{\n  q\n  {\n    elbow 1\n  }\n}\nphase 1\nphase 2\n", "t.info").places();
  EXPECT_EQ(places.at("start.q.elbow", "t.info"), "t.info:5:11");
  EXPECT_EQ(places.at("start.q.wrist", "t.info"), "t.info:3:3");
  EXPECT_EQ(places.at("start.v.elbow", "t.info"), "t.info:1:1");
  EXPECT_EQ(places.at("phase", "t.info"), "t.info:8:7");  // the first
  EXPECT_EQ(places.at("goal.q", "t.info"), "t.info");
}

TEST(Suggest, distance_is_a_metric_on_random_words) {
  for (unsigned seed = 0; seed < 300; ++seed) {
    std::mt19937_64 random(seed);
    const auto word = [&] {
      std::string text;
      for (auto n = random() % 6; n > 0; --n) text += static_cast<char>('a' + random() % 3);
      return text;
    };
    const std::string a = word(), b = word();
    ASSERT_EQ(edit_distance(a, b), edit_distance(b, a)) << "seed " << seed;
    ASSERT_EQ(edit_distance(a, b) == 0, a == b) << "seed " << seed;
    ASSERT_LE(edit_distance(a, b), static_cast<int>(std::max(a.size(), b.size()))) << "seed " << seed;
  }
  EXPECT_EQ(edit_distance("ab", "ba"), 1);
  EXPECT_EQ(nearest_name("h", {"H", "dt"}), "H");
  EXPECT_EQ(nearest_name("h", {"g", "dt"}), "");
}

}  // namespace
}  // namespace dyntape::io::io_section_test
