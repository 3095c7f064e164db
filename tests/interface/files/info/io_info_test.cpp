// SPDX-License-Identifier: BSD-3-Clause
//
// The reader of .info text against Boost.PropertyTree's, on written and on random files.
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/files/info/info.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <boost/property_tree/info_parser.hpp>
#include <filesystem>
#include <functional>
#include <random>
#include <sstream>

namespace dyntape::io::io_info_test {
namespace {

using boost::property_tree::ptree;

// Both trees as one text, so that a failure shows where they differ.
void append(const ptree& tree, int depth, std::string& text) {
  for (const auto& [key, child] : tree) {
    text += std::string(depth, ' ') + "<" + key + "> <" + child.data() + ">\n";
    append(child, depth + 1, text);
  }
}
void append(const InfoNode& tree, int depth, std::string& text) {
  for (const InfoNode& child : tree.children) {
    text += std::string(depth, ' ') + "<" + child.key + "> <" + child.value + ">\n";
    append(child, depth + 1, text);
  }
}

std::string boost_reading(const std::string& text) {
  std::istringstream stream(text);
  ptree tree;
  try {
    boost::property_tree::read_info(stream, tree);
  } catch (const boost::property_tree::info_parser_error&) {
    return "error";
  }
  std::string printed;
  append(tree, 0, printed);
  return printed;
}

std::string our_reading(const std::string& text) {
  std::string printed;
  try {
    append(parse_info(text, "test.info"), 0, printed);
  } catch (const FileError&) {
    return "error";
  }
  return printed;
}

std::string problems_of(const std::string& text) {
  try {
    parse_info(text, "t.info");
  } catch (const FileError& error) {
    return error.what();
  }
  return "";
}

TEST(InfoText, tricky_files_read_as_boost_reads_them) {
  const std::vector<std::string> corpus = {
      "",
      "\n\n ; only a comment",
      "a",
      "a 1",
      "a 1 b 2 c",
      "a 1 // old words here\n",
      "a = 1\n",
      "a { b 1 }",
      "a\n{\nb 1\n}\n",
      "a 1\n\n; comment\n{\n b 2\n}",
      "a 1 { b 2 } c 3",
      "a { b } c",
      "a{ b }",
      "a { b}",
      "a {b 1}\n",
      "a {} b {}",
      "{ a 1 }",
      "a { b 1",
      "a 1 }",
      "a { } { b 1 }",
      "a \"x y\" b",
      "a \"x\"y",
      "\"k e y\" \"v\"",
      "\"k\"{ \"\" \"\" }",
      "a \"x\" \\\n \"y\" \\ ; note\n\n; comment\n  \"z\"\nb 1",
      "a \"x\" \\ y",
      "a \"x\" \\\n y",
      "a \"x\" \\\n",
      "a x \\\n",
      "\"a\" \\\n \"b\"",
      "a \"open",
      "a \"tail\\\"",
      "a \"\\0\\a\\b\\f\\n\\r\\t\\v\\\"\\'\\\\\"",
      "a \\n\\t",
      "a \\q",
      "a b\\",
      "a \\;b",
      "a \";not a comment\" ; a comment",
      "a b;c\nd;e",
      "a #b\n#c",
      "# include",
      "#include nothing",
      "#include \"/does/not/exist\"",
      "a 1 2 3 {\n x }",
      "a\r\n{\r\n b 1\r\n}\r\n",
      "\ta\v1\f\n",
      "a \xC3\xA4\xE2\x82\xAC \xA0",
      "[0] \"a, b\"\n(0,0) 1\n",
      "a 1\na 2\na 3",
  };
  int accepted = 0;
  for (const std::string& text : corpus) {
    const std::string ours = our_reading(text);  // may refuse more, never reads otherwise
    accepted += ours != "error";
    EXPECT_TRUE(ours == "error" || ours == boost_reading(text)) << text;
  }
  EXPECT_GT(accepted, 15);
}

using Random = std::mt19937_64;
int below(Random& random, int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); }

std::string random_blank(Random& random) {
  const char* choices[] = {" ", "  ", "\t", " \t ", "\r "};
  return choices[below(random, 5)];
}

std::string random_word(Random& random) {
  const char* pieces[] = {"a",   "q",  "[0]", "(0,1)", "-1.5e-3",  "\\n", "\\\\", "//", "=",    "true",
                          "x{y", ":/", "\"",  "#",     "\xC3\xA4", "'",   ",",    ".",  "\\\"", "b}"};
  std::string word;
  for (int n = 1 + below(random, 3); n > 0; --n) word += pieces[below(random, 20)];
  return word.front() == '"' || word.front() == '#' ? "w" + word : word;
}

std::string random_quoted(Random& random) {
  const char* pieces[] = {"a", " ", "\\\"", "\\n", ";", "{", "}", "\\\\", "#", "\\t"};
  std::string word = "\"";
  for (int n = below(random, 5); n > 0; --n) word += pieces[below(random, 10)];
  return word + "\"";
}

std::string random_end(Random& random) {
  const char* choices[] = {"\n", " ; note { \"\n", "\n\n", " \n ; x\n"};
  return choices[below(random, 4)];
}

std::string random_value(Random& random) {
  if (below(random, 2)) return random_word(random);
  std::string text = random_quoted(random);
  while (below(random, 4) == 0) text += " \\" + random_end(random) + " " + random_quoted(random);
  return text;
}

// A valid file by construction.
void random_block(Random& random, int depth, std::string& text) {
  for (int n = below(random, 5); n > 0; --n) {
    text += random_blank(random) + (below(random, 4) ? random_word(random) : random_quoted(random));
    if (below(random, 3)) text += random_blank(random) + random_value(random);
    if (depth < 4 && below(random, 3) == 0) {
      text +=
          (below(random, 2) ? random_end(random) : " ") + std::string("{") + (below(random, 2) ? "\n" : " ");
      random_block(random, depth + 1, text);
      text += (below(random, 2) ? random_end(random) : " ") + std::string("}");
    }
    text += random_end(random);
  }
}

TEST(InfoText, random_valid_files_read_as_boost_reads_them) {
  int valid = 0;
  for (unsigned seed = 0; seed < 4000; ++seed) {
    Random random(seed);
    std::string text;
    random_block(random, 0, text);
    const std::string ours = our_reading(text);
    valid += ours != "error";
    ASSERT_TRUE(ours == "error" || ours == boost_reading(text)) << "seed " << seed << "\n" << text;
  }
  EXPECT_GT(valid, 1000);
}

// Any bytes at all: what is accepted is read alike.
TEST(InfoText, random_bytes_are_refused_or_read_as_boost_reads_them) {
  const std::string alphabet("ab \t\n\n;{}{}\"\"\\\\#=\0\r", 19);
  int accepted = 0, ours_accepted = 0;
  for (unsigned seed = 0; seed < 20000; ++seed) {
    Random random(seed);
    std::string text;
    for (int n = below(random, 24); n > 0; --n)
      text += alphabet[below(random, static_cast<int>(alphabet.size()))];
    const std::string expected = boost_reading(text);
    accepted += expected != "error";
    const std::string ours = our_reading(text);
    ours_accepted += ours != "error";
    ASSERT_TRUE(ours == "error" || ours == expected) << "seed " << seed << "\n" << text;
  }
  EXPECT_GT(ours_accepted, 1000);
  EXPECT_GT(accepted, ours_accepted);
}

InfoNode random_tree(Random& random, int depth) {
  InfoNode node;
  const auto bytes = [&] {
    std::string text;
    for (int n = below(random, 6); n > 0; --n) text += static_cast<char>(below(random, 256));
    return text;
  };
  for (int n = below(random, 4); n > 0 && depth < 4; --n) {
    node.children.push_back(random_tree(random, depth + 1));
    node.children.back().key = bytes();
    node.children.back().value = bytes();
  }
  return node;
}

TEST(InfoText, what_is_written_reads_back_and_by_boost) {
  for (unsigned seed = 0; seed < 500; ++seed) {
    Random random(seed);
    const InfoNode tree = random_tree(random, 0);
    std::string expected;
    append(tree, 0, expected);
    const std::string text = write_info(tree);
    ASSERT_EQ(our_reading(text), expected) << "seed " << seed << "\n" << text;
    ASSERT_EQ(boost_reading(text), expected) << "seed " << seed << "\n" << text;
  }
}

TEST(InfoText, positions_are_those_of_the_text) {
  const InfoNode root = parse_info("a\n{\n  key  \"v\"\n}\n", "p.info");
  EXPECT_EQ(to_string(root.children[0].where), "p.info:1:1");
  EXPECT_EQ(to_string(root.children[0].children[0].where), "p.info:3:3");
  EXPECT_EQ(to_string(root.children[0].children[0].value_where), "p.info:3:8");
}

TEST(InfoText, several_keys_stand_on_a_line) {
  const InfoNode root = parse_info("q { shoulder 0  elbow \"1 2\"  hand { x 1 } } next on last\n", "t.info");
  ASSERT_EQ(root.children.size(), 3u);
  const InfoNode& q = root.children[0];
  ASSERT_EQ(q.children.size(), 3u);
  EXPECT_EQ(q.children[1].key, "elbow");
  EXPECT_EQ(q.children[1].value, "1 2");
  EXPECT_EQ(q.children[2].children[0].value, "1");
  EXPECT_EQ(root.children[1].value, "on");
  EXPECT_FALSE(root.children[2].has_value);
}

TEST(InfoText, names_what_looks_like_a_mistake) {
  const struct {
    const char *text, *message;
  } cases[] = {
      {"a 1 // why\n", "t.info:1:5: '//' does not start a comment"},
      {"a { \n} // end of a\n", "t.info:2:3: '//' does not start a comment"},
      {"// title\n", "t.info:1:1: '//' does not start a comment"},
      {"a // later\n", "t.info:1:3: '//' does not start a comment"},
      {"a 1 # why\n", "t.info:1:5: '#' does not start a comment in this format, ';' does"},
      {"a # later\n", "t.info:1:3: '#' does not start a comment in this format, ';' does"},
      {"# title\n",
       "t.info:1:1: unknown directive '#title'; only #include is known, and a comment begins with ';'"},
      {"a = 1\n", "t.info:1:3: '=' would be the value"},
      {"a=1\n", "t.info:1:1: the key 'a=1' contains '='"},
      {"a 1 2\n", "t.info:1:5: '2' follows the value of 'a' on its line; write a list of numbers in quotes"},
      {"a { b 1}\n", "t.info:1:7: the brace is part of the value '1}'"},
      {"a { b 1\n", "t.info:1:3: the block of 'a' is never closed"},
      {"a 1\n}\n", "t.info:2:1: '}' closes nothing"},
      {"{\n}\n", "t.info:1:1: '{' without a key before it"},
      {"a \"open\n", "t.info:1:3: the quoted text is not closed"},
      {"a \"\\q\"\n", "t.info:1:3: unknown escape '\\q'"},
      {"a \"x\" \\\n", "the file ends where a value was to be continued"},
      {"#define x\n", "t.info:1:1: unknown directive '#define'"},
  };
  for (const auto& [text, message] : cases) {
    EXPECT_NE(problems_of(text).find(message), std::string::npos) << text << problems_of(text);
  }
  EXPECT_NE(problems_of(std::string("a b\0c", 5)).find("byte zero"), std::string::npos);
}

TEST(InfoText, all_problems_are_reported_at_once_in_order) {
  EXPECT_EQ(
      problems_of("a = 1\nb \"open\nc 1 // x\n}\n"),
      "t.info:1:3: '=' would be the value: in this format a blank stands between key and value\n"
      "t.info:2:3: the quoted text is not closed on its line\n"
      "t.info:3:5: '//' does not start a comment in this format, ';' does (quote a value that starts so)\n"
      "t.info:4:1: '}' closes nothing");
}

TEST(InfoText, depth_is_limited) {
  const auto nested = [](int n) {
    std::string text;
    for (int i = 0; i < n; ++i) text += "a {\n";
    for (int i = 0; i < n; ++i) text += "}\n";
    return text;
  };
  EXPECT_EQ(problems_of(nested(kMaxDepth)), "");
  EXPECT_NE(problems_of(nested(kMaxDepth + 1)).find("t.info:101:3: blocks are nested deeper than 100"),
            std::string::npos);
  EXPECT_NE(problems_of(nested(1000000)).find("nested deeper"), std::string::npos);
}

TEST(InfoText, a_byte_order_mark_is_skipped) {
  EXPECT_EQ(our_reading("\xEF\xBB\xBF"
                        "a 1"),
            "<a> <1>\n");
}

class InfoFiles : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(path_ / "parts"); }
  void TearDown() override { std::filesystem::remove_all(path_); }
  std::filesystem::path path_ =
      std::filesystem::temp_directory_path() / ("dyntape-info-test-" + std::to_string(::getpid()));
};

TEST_F(InfoFiles, includes_are_found_beside_the_file_and_keep_their_positions) {
  write_file_atomically(path_ / "main.info", "a\n{\n  #include \"parts/one.info\"\n}\nz 1\n");
  write_file_atomically(path_ / "parts/one.info", "b 1\n#include \"two.info\"\n");
  write_file_atomically(path_ / "parts/two.info", "c 2\n");
  const InfoNode root = parse_info(read_file(path_ / "main.info"), path_ / "main.info");
  ASSERT_EQ(root.children[0].children.size(), 2u);
  EXPECT_EQ(to_string(root.children[0].children[1].where), (path_ / "parts/two.info").string() + ":1:1");
  write_file_atomically(path_ / "plain.info",
                        "a\n{\n  #include \"" + (path_ / "parts/two.info").string() + "\"\n}\n");
  const std::string text = read_file(path_ / "plain.info");
  EXPECT_EQ(our_reading(text), boost_reading(text));
}

TEST_F(InfoFiles, a_file_that_includes_itself_is_an_error) {
  write_file_atomically(path_ / "loop.info", "#include \"loop.info\"\n");
  EXPECT_THROW(
      {
        try {
          parse_info(read_file(path_ / "loop.info"), path_ / "loop.info");
        } catch (const FileError& error) {
          EXPECT_NE(std::string(error.what()).find("does one include itself?"), std::string::npos)
              << error.what();
          throw;
        }
      },
      FileError);
}

TEST_F(InfoFiles, includes_that_multiply_are_an_error) {
  const auto problem_of = [&](const std::string& file) {
    try {
      parse_info(read_file(path_ / file), path_ / file);
    } catch (const FileError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const auto name = [](int k) { return "level" + std::to_string(k) + ".info"; };
  for (int k = 0; k < 31; ++k) {
    const std::string line = "#include \"" + name(k + 1) + "\"\n";
    write_file_atomically(path_ / name(k), line + line);
  }
  write_file_atomically(path_ / name(31), "");
  const std::string problem = problem_of(name(0));
  EXPECT_NE(problem.find("#include lines bring in more than 1000 files or 64 MiB"), std::string::npos)
      << problem;
  EXPECT_EQ(std::count(problem.begin(), problem.end(), '\n'), 0);
  EXPECT_EQ(problem_of(name(23)), "");  // 510 lines

  write_file_atomically(path_ / "large.info", ';' + std::string(2 << 20, ' '));
  std::string lines;
  for (int k = 0; k < 40; ++k) lines += "#include \"large.info\"\n";
  write_file_atomically(path_ / "many.info", lines);
  const std::string too_large = problem_of("many.info");  // 32 files of a byte more than 2 MiB
  EXPECT_NE(too_large.find("many.info:32:10: #include lines bring in"), std::string::npos) << too_large;
}

}  // namespace
}  // namespace dyntape::io::io_info_test
