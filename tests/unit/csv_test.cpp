#include "harness/csv.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

/// A file of its own for each test, removed afterwards.
class Csv : public testing::Test {
 protected:
  Csv() {
    const auto* const info = testing::UnitTest::GetInstance()->current_test_info();
    const std::string name =
        std::string("penumbra_csv_") + info->name() + std::to_string(::getpid());
    file_ = std::filesystem::temp_directory_path() / name;
    std::filesystem::remove(file_);
  }
  ~Csv() override { std::filesystem::remove(file_); }

  void put(const std::string& text) const { std::ofstream(file_, std::ios::binary) << text; }

  std::string get() const {
    std::ifstream stream(file_, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }

  /// The message of the error that reading this text gives; empty for none.
  std::string fault(const std::string& text) const {
    put(text);
    try {
      read_csv(file_);
    } catch (const InputError& error) {
      return error.what();
    }
    return {};
  }

  std::filesystem::path file_;
};

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(CsvText, DoublesReadBackToTheSameBits) {
  for (const double value : {0.1, 1.0 / 3.0, 1e-310, -0.0, 1e300, 123456789.0}) {
    double back = 0;
    ASSERT_TRUE(parse_csv(csv_text(value), back)) << csv_text(value);
    EXPECT_EQ(back, value);
    EXPECT_EQ(std::signbit(back), std::signbit(value));
  }
  EXPECT_EQ(csv_text(0.1), "0.1");
  EXPECT_EQ(csv_text(std::optional<double>{}), "");
}

TEST(CsvText, NonFiniteNumbersStayNonFinite) {
  double back = 0;
  ASSERT_TRUE(parse_csv(csv_text(std::numeric_limits<double>::quiet_NaN()), back));
  EXPECT_TRUE(std::isnan(back));
  ASSERT_TRUE(parse_csv(csv_text(-std::numeric_limits<double>::infinity()), back));
  EXPECT_EQ(back, -std::numeric_limits<double>::infinity());
}

TEST(CsvText, OnlyAWholeValueIsRead) {
  double number = 7;
  int whole = 7;
  for (const char* text : {"", "1x", " 1", "1 ", "abc"}) {
    EXPECT_FALSE(parse_csv(text, number)) << '"' << text << '"';
    EXPECT_FALSE(parse_csv(text, whole)) << '"' << text << '"';
  }
  EXPECT_FALSE(parse_csv("1.5", whole));
  EXPECT_FALSE(parse_csv("99999999999", whole));
  EXPECT_EQ(number, 7);
  EXPECT_EQ(whole, 7);
  std::optional<int> maybe = 3;
  EXPECT_TRUE(parse_csv("", maybe));
  EXPECT_FALSE(maybe.has_value());
  EXPECT_FALSE(parse_csv("x", maybe));
}

TEST(CsvLine, QuotesWhatRfc4180Quotes) {
  EXPECT_EQ(csv_line(CsvRecord{"a", "b,c", "d\"e", "f\ng", ""}),
            "a,\"b,c\",\"d\"\"e\",\"f\ng\",\r\n");
}

TEST_F(Csv, WrittenRowsReadBack) {
  const CsvRecord header{"name", "text"};
  const CsvRecord first{"a,b", "say \"x\"\r\nand y"};
  const CsvRecord second{"", "\xC3\xA4"};
  {
    CsvWriter writer(file_, header);
    writer.append(first);
    writer.append(second);
  }
  const CsvTable table = read_csv(file_);
  EXPECT_EQ(table.header, header);
  ASSERT_EQ(table.rows.size(), 2u);
  EXPECT_EQ(table.rows[0], first);
  EXPECT_EQ(table.rows[1], second);
  EXPECT_FALSE(table.torn_tail);
  EXPECT_EQ(table.complete_bytes, get().size());
  EXPECT_EQ(table.column("text").value(), 1u);
  EXPECT_FALSE(table.column("nothing").has_value());
}

TEST_F(Csv, BothLineEndsAndAByteOrderMarkAreRead) {
  put("\xEF\xBB\xBF"
      "a,b\n1,2\r\n3,4\n");
  const CsvTable table = read_csv(file_);
  EXPECT_EQ(table.header, (CsvRecord{"a", "b"}));
  ASSERT_EQ(table.rows.size(), 2u);
  EXPECT_EQ(table.rows[0], (CsvRecord{"1", "2"}));
  EXPECT_EQ(table.rows[1], (CsvRecord{"3", "4"}));
}

TEST_F(Csv, EmptyFileIsAnEmptyTable) {
  put("");
  const CsvTable table = read_csv(file_);
  EXPECT_TRUE(table.header.empty());
  EXPECT_FALSE(table.torn_tail);
}

TEST_F(Csv, EveryTornFileKeepsItsCompleteLinesAndCanBeContinued) {
  const CsvRecord header{"a", "b"};
  const std::vector<CsvRecord> rows{{"1", "x,y"}, {"22", "\"q\""}, {"", ""}};
  std::string text = csv_line(header);
  std::vector<std::size_t> ends{text.size()};
  for (const CsvRecord& row : rows) {
    text += csv_line(row);
    ends.push_back(text.size());
  }
  for (std::size_t length = 0; length <= text.size(); ++length) {
    put(text.substr(0, length));
    std::size_t complete = 0;  // lines
    while (complete < ends.size() && ends[complete] <= length) ++complete;
    const std::size_t bytes = complete == 0 ? 0 : ends[complete - 1];
    const CsvTable table = read_csv(file_);
    EXPECT_EQ(table.rows.size(), complete == 0 ? 0 : complete - 1) << length;
    EXPECT_EQ(table.torn_tail, bytes != length) << length;
    EXPECT_EQ(table.complete_bytes, bytes) << length;
    if (table.torn_tail) {
      EXPECT_THROW(CsvWriter(file_, header), RunError) << length;
    }
    EXPECT_EQ(truncate_torn_tail(file_), bytes != length) << length;
    EXPECT_EQ(get(), text.substr(0, bytes)) << length;
    CsvWriter(file_, header).append(CsvRecord{"n", "m"});
    EXPECT_EQ(read_csv(file_).rows.back(), (CsvRecord{"n", "m"})) << length;
  }
}

TEST_F(Csv, LastLineWithTooFewFieldsIsTorn) {
  put("a,b\n1,2\n3\n");
  const CsvTable table = read_csv(file_);
  EXPECT_TRUE(table.torn_tail);
  EXPECT_EQ(table.rows.size(), 1u);
  EXPECT_EQ(table.complete_bytes, 8u);
}

TEST_F(Csv, MalformedFilesAreErrorsWithTheirLine) {
  EXPECT_TRUE(contains(fault("a,b\n1\n3,4\n"), ":2: 1 fields where the header has 2"));
  EXPECT_TRUE(contains(fault("a,b\n1,2\n1,2,3\n"), ":3: 3 fields"));
  EXPECT_TRUE(contains(fault("a,b\n1,\"2\"x\n"), ":2: text after a closing quote"));
  EXPECT_TRUE(contains(fault("a,b\n1,2\"x\n"), ":2: quote inside"));
  EXPECT_TRUE(contains(fault("a,b\n1\r,2\n"), ":2: carriage return"));
  EXPECT_TRUE(contains(fault("a,a\n"), "\"a\" occurs twice"));
  EXPECT_THROW(read_csv(file_ / "missing"), InputError);
  EXPECT_THROW(read_csv(std::filesystem::temp_directory_path()), RunError);
}

TEST_F(Csv, UnclosedQuoteDoesNotPassForATornTail) {
  EXPECT_TRUE(contains(fault("a,b\n1,\"2\n3,4\n5,6\n"), ":2: a quoted field is never closed"));
  EXPECT_THROW(truncate_torn_tail(file_), InputError);
  EXPECT_EQ(get(), "a,b\n1,\"2\n3,4\n5,6\n");
}

TEST_F(Csv, WriterAppendsToWhatIsThere) {
  CsvWriter(file_, {"a", "b"}).append(CsvRecord{"1", "2"});
  CsvWriter(file_, {"a", "b"}).append(CsvRecord{"3", "4"});
  EXPECT_EQ(get(), "a,b\r\n1,2\r\n3,4\r\n");
}

TEST_F(Csv, WriterRefusesAnotherHeader) {
  put("a,c\n1,2\n");
  try {
    CsvWriter writer(file_, {"a", "b"});
    FAIL() << "accepted";
  } catch (const RunError& error) {
    EXPECT_TRUE(contains(error.what(), file_.string())) << error.what();
    EXPECT_TRUE(contains(error.what(), "a,c")) << error.what();
  }
  EXPECT_EQ(get(), "a,c\n1,2\n");
}

TEST_F(Csv, FileHasOneWriter) {
  const CsvWriter writer(file_, {"a"});
  EXPECT_THROW(CsvWriter(file_, {"a"}), RunError);
}

TEST_F(Csv, FullDiskIsARunErrorWithPathAndReason) {
  try {
    CsvWriter writer("/dev/full", {"a"});
    FAIL() << "written to a full device";
  } catch (const RunError& error) {
    EXPECT_TRUE(contains(error.what(), "/dev/full")) << error.what();
    EXPECT_TRUE(contains(error.what(), "No space left on device")) << error.what();
  }
  EXPECT_THROW(CsvWriter(file_ / "no" / "such", {"a"}), RunError);
}

TEST_F(Csv, RowThatFitsOnlyInPartIsTakenBack) {
  CsvWriter writer(file_, {"a"});
  writer.append(CsvRecord{"1"});
  const std::string before = get();
  rlimit old_limit{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &old_limit), 0);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit limit{before.size() + 10, old_limit.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
  std::string message;
  try {
    writer.append(CsvRecord{std::string(100, 'x')});
  } catch (const RunError& error) {
    message = error.what();
  }
  ::setrlimit(RLIMIT_FSIZE, &old_limit);
  std::signal(SIGXFSZ, old_handler);
  EXPECT_TRUE(contains(message, "File too large")) << message;
  EXPECT_EQ(get(), before);
  writer.append(CsvRecord{"2"});
  EXPECT_EQ(get(), before + "2\r\n");
}

}  // namespace
}  // namespace penumbra
