// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/files/info/section.h>
#include <dyntape/interface/io/csv.h>
#include <gtest/gtest.h>

#include <sys/stat.h>
#include <unistd.h>
#include <Eigen/Core>

#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <ctime>
#include <filesystem>
#include <limits>
#include <locale>
#include <random>
#include <thread>

namespace dyntape::io::io_csv_test {
namespace {

std::string refusal(const std::string& text) {
  try {
    parse_csv(text, "t.csv");
  } catch (const FileError& error) {
    return error.what();
  }
  return "";
}

TEST(Csv, every_bit_of_random_doubles_survives) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::mt19937_64 random(seed);
    const int cols = 1 + static_cast<int>(random() % 7);
    std::vector<std::string> names;
    for (int j = 0; j < cols; ++j) names.push_back("c" + std::to_string(j));
    CsvTable table(names);
    std::vector<double> row(names.size());
    for (int i = 0; i < 100; ++i) {
      for (double& value : row) {
        do value = std::bit_cast<double>(static_cast<std::uint64_t>(random()));
        while (!std::isfinite(value));
      }
      table.append(row);
    }
    const CsvTable again = parse_csv(format_csv(table), "t.csv");
    ASSERT_EQ(again.names(), names);
    ASSERT_EQ(again.rows(), 100);
    for (size_t k = 0; k < table.values().size(); ++k) {
      const double a = table.values()[k], b = again.values()[k];
      ASSERT_EQ(std::bit_cast<std::uint64_t>(a), std::bit_cast<std::uint64_t>(b)) << "seed " << seed;
    }
  }
}

TEST(Csv, marks_line_ends_blanks_and_quotes_are_tolerated) {
  const CsvTable table = parse_csv("\xEF\xBB\xBF t ,\"a,\"\"b\"\r\n 1 ,\t+2\r\n3,-4e0\r\n\r\n\n", "t.csv");
  EXPECT_EQ(table.names(), (std::vector<std::string>{"t", "a,\"b"}));
  EXPECT_EQ(table.column("a,\"b"), (std::vector<double>{2, -4}));
  EXPECT_EQ(parse_csv(format_csv(table), "again.csv").names(), table.names());
}

TEST(Csv, refusals_say_where_and_why) {
  EXPECT_EQ(refusal(""), "t.csv:1:1: there is no header line");
  EXPECT_EQ(refusal("0,2,0\n3,4,0\n"),
            "t.csv:1:1: the first line must name the columns, but it holds numbers");
  EXPECT_EQ(refusal("1,2\n3,4\n"), "t.csv:1:1: the first line must name the columns, but it holds numbers");
  EXPECT_EQ(refusal("a,,b\n"), "t.csv:1:3: column 2 has no name");
  EXPECT_EQ(refusal("a,b,a\n"), "t.csv:1:5: two columns are named 'a'");
  EXPECT_EQ(refusal("a,b\n1\n"), "t.csv:2:1: the row has 1 entries, the header names 2");
  EXPECT_EQ(refusal("a,b\n1,2,3\n"), "t.csv:2:5: the row has 3 entries, the header names 2");
  EXPECT_EQ(refusal("a,b\n1,2,\n"), "t.csv:2:5: the row has 3 entries, the header names 2");
  EXPECT_EQ(refusal("a,b\n1, x\n"), "t.csv:2:4: column 'b' expects a number, got 'x'");
  EXPECT_EQ(refusal("a,b\n1,\n"), "t.csv:2:3: column 'b' expects a number, got ''");
  EXPECT_EQ(refusal("a;b\n1;2\n"), "t.csv:1:1: the columns are separated by ';', expected ','");
  EXPECT_EQ(refusal("a\n1\n\n2\n"), "t.csv:3:1: the line is empty, but rows follow");
  EXPECT_EQ(refusal("a\n1e999\n"),
            "t.csv:2:1: column 'a' expects a number in the range of a double, got '1e999'");
  EXPECT_EQ(refusal("a\n1e-400\n"),
            "t.csv:2:1: column 'a' expects a number in the range of a double, got '1e-400'");
  EXPECT_EQ(refusal("a\r1\r"),
            "t.csv:1:2: a carriage return within a line; expected lines that end in LF or CR LF");
  EXPECT_EQ(refusal("a\nnan\n"), "t.csv:2:1: column 'a' expects a finite number, got 'nan'");
}

TEST(Csv, wrong_use_is_an_argument_error) {
  CsvTable table({"q0", "q1"});
  EXPECT_THROW(table.append({1.0}), ArgumentError);
  EXPECT_THROW(CsvTable({"a", "a"}), ArgumentError);
  EXPECT_THROW(CsvTable({"a", "b\n"}), ArgumentError);
  EXPECT_THROW(table.column("q2"), ArgumentError);
  table.append({1.0, std::numeric_limits<double>::quiet_NaN()});
  EXPECT_THROW(format_csv(table), ArgumentError);
  EXPECT_EQ(format_csv(table, NonFinite::kAllow), "q0,q1\n1,nan\n");
}

// Decimal comma and dots between thousands, as a program around the library may have set.
struct Continental : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

TEST(Csv, the_locale_does_not_matter) {
  const std::locale before = std::locale::global(std::locale(std::locale::classic(), new Continental));
  CsvTable table({"a"});
  table.append({12345.5});
  EXPECT_EQ(format_csv(table), "a\n12345.5\n");
  EXPECT_EQ(parse_csv("a\n12345.5\n", "t.csv")(0, 0), 12345.5);
  Section section = Section::parse("a 12345.5", "t.info");
  EXPECT_EQ(section.get<double>("a"), 12345.5);
  EXPECT_EQ(section.effective_values(), "a 12345.5\n");
  std::locale::global(before);
}

class CsvFiles : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  int count() const {
    return static_cast<int>(std::distance(std::filesystem::directory_iterator(folder_), {}));
  }
  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("dyntape-file-test-" + std::to_string(::getpid()));
};

TEST_F(CsvFiles, a_reader_never_sees_a_half_written_file) {
  const std::string path = folder_ / "x.csv";
  const std::string texts[] = {std::string(300000, 'a'), std::string(200000, 'b')};
  write_file_atomically(path, texts[0]);
  std::atomic<bool> stop = false;
  std::vector<std::thread> writers;
  for (int w = 0; w < 2; ++w) {
    writers.emplace_back([&, w] {
      while (!stop) write_file_atomically(path, texts[w]);
    });
  }
  int wrong = 0;
  for (int i = 0; i < 100; ++i) {
    const std::string text = read_file(path);
    wrong += text != texts[0] && text != texts[1];
  }
  stop = true;
  for (std::thread& writer : writers) writer.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(count(), 1) << "temporary files were left behind";
}

TEST(Csv, many_columns_take_linear_time) {
  const auto seconds = [](int cols) {
    const std::clock_t start = std::clock();
    std::vector<std::string> names;
    for (int j = 0; j < cols; ++j)
      names.push_back("d_" + std::to_string(j / 300) + "_" + std::to_string(j % 300));
    CsvTable table(names);
    table.append(std::vector<double>(names.size(), 0.25));
    const CsvTable again = parse_csv(format_csv(table), "t.csv");
    for (int j = 0; j < cols; ++j) EXPECT_EQ(again.index(names[static_cast<size_t>(j)]), j);
    return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  };
  const double some = seconds(22500);
  EXPECT_LT(seconds(90000), 10 * some + 0.2);
}

TEST_F(CsvFiles, a_failed_write_leaves_nothing) {
  std::filesystem::create_directories(folder_ / "is_a_folder.csv" / "full");
  EXPECT_THROW(write_file_atomically(folder_ / "is_a_folder.csv", "x"), FileError);
  EXPECT_EQ(count(), 1);
  EXPECT_THROW(read_file(folder_ / "absent.csv"), FileError);
  EXPECT_THROW(read_file(folder_), FileError);
}

TEST_F(CsvFiles, missing_folders_are_made) {
  write_csv(folder_ / "a/b/c.csv", CsvTable({"t"}));
  EXPECT_EQ(read_file(folder_ / "a/b/c.csv"), "t\n");
}

// Of a table that was read a column is missing in a file, which is named with the nearest column that it has.
TEST(Csv, a_missing_column_is_told_with_its_file) {
  const auto said = [](const CsvTable& table) {
    try {
      table.column("t");
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("nothing thrown");
  };
  EXPECT_EQ(said(parse_csv("tt,q\n1,2\n", "measured.csv")),
            "measured.csv:1: there is no column 't'; did you mean 'tt'?");
  EXPECT_EQ(said(CsvTable({"tt", "q"})), "CsvTable: there is no column 't'; did you mean 'tt'?");
  EXPECT_THROW(parse_csv("a\n1\n", "measured.csv").column("t"), FileError);
}

TEST(Csv, columns_stand_side_by_side) {
  Eigen::MatrixXd q(2, 3);
  q << 1, 2, 3, 4, 5, 6;
  CsvColumns columns;
  columns.add("t", {0, 0.5, 1});
  columns.add({"q.a", "q.b"}, q);
  EXPECT_EQ(format_csv(columns.table()), "t,q.a,q.b\n0,1,4\n0.5,2,5\n1,3,6\n");
  EXPECT_EQ(CsvColumns().table().rows(), 0);
}

}  // namespace
}  // namespace dyntape::io::io_csv_test
