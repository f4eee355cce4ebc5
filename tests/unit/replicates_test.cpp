// What replicates say, on images whose variance and bias are known by construction.

#include "harness/replicates.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <random>

#include "harness/exr.h"
#include "harness/replicate_files.h"
#include "scenes/core/error.h"
#include "tests/unit/run_row_fixture.h"

namespace penumbra {
namespace {

using Pixels = std::vector<Rgb>;

ReplicateSummary summary_of(const std::vector<Pixels>& images, const ReplicateReference& reference,
                            int width) {
  ReplicateSums sums(width, static_cast<int>(images[0].size()) / width);
  for (const Pixels& image : images) sums.add(image);
  return sums.summary(reference);
}

TEST(Replicates, VarianceAndBiasMatchHandComputation) {
  // Pixel 1: 1, 3 in all channels: mean 2, variance 2; pixel 2: (0,0,0), (6,0,0): mean (3,0,0),
  // variance (18,0,0).
  const std::vector<Pixels> images{{Rgb(1), {0, 0, 0}}, {Rgb(3), {6, 0, 0}}};
  const Pixels half_a{Rgb(1), {2, 0, 0}};
  const Pixels half_b{Rgb(2), {1, 1, 0}};
  const ReplicateSummary s = summary_of(images, {{half_a, half_b}}, 2);
  EXPECT_EQ(s.count, 2);
  EXPECT_DOUBLE_EQ(s.variance, (2.0 + 6.0) / 2.0);
  // (2-1)(2-2) = 0 in each channel; (3-2)(3-1) = 2, (0-0)(0-1) = 0, 0: mean over channels 2/3.
  EXPECT_DOUBLE_EQ(s.bias2, (0.0 + 2.0 / 3.0) / 2.0 - 4.0 / 2.0);
  // v = 2, 6 with one degree of freedom: 3 (8)^2 / 40 - 2.
  EXPECT_DOUBLE_EQ(s.p_eff.value(), 3.0 * 64.0 / 40.0 - 2.0);
  EXPECT_EQ(s.mean.pixels[1], Rgb(3, 0, 0));
  EXPECT_FLOAT_EQ(s.standard_deviation.pixels[0].y, std::sqrt(2.0f));
  EXPECT_FLOAT_EQ(s.standard_deviation.pixels[1].x, std::sqrt(18.0f));
  EXPECT_FALSE(s.bias.has_value()) << "too few replicates for a test";
}

TEST(Replicates, LargeMeansDoNotDrownASmallVariance) {
  // 4096 -+ 2^-10: float holds them, and the variance is 2^-20 x 4/3 of the four.
  const float d = 1.0f / 1024.0f;
  const Pixels up{Rgb(4096 + d)};
  const Pixels down{Rgb(4096 - d)};
  const ReplicateSummary s = summary_of({up, down, up, down}, {{up, up}}, 1);
  EXPECT_NEAR(s.variance, 4.0 / 3.0 * 0x1p-20, 1e-12);
}

TEST(Replicates, NeedTwoImagesOfTheReferencesSize) {
  const Pixels one{Rgb(1)};
  const Pixels two{Rgb(1), Rgb(1)};
  EXPECT_THROW(summary_of({one}, {{one, one}}, 1), InputError);
  EXPECT_THROW(summary_of({one, one}, {{two, two}}, 1), InputError);
  EXPECT_THROW(summary_of({one, two}, {{one, one}}, 1), InputError);
}

TEST(TileEstimates, VarianceIsThatOfTheMeanOfIndependentPixels) {
  // (A-B)/2 = 1, 2, 0, 0 grey: variances 1 and 4 over 4^2.
  const Pixels a{Rgb(2), Rgb(4), Rgb(1), Rgb(1)};
  const Pixels b{Rgb(0), Rgb(0), Rgb(1), Rgb(1)};
  const auto tiles = bias_tiles(4, 1, std::vector<int>{2});
  const auto e = tile_estimates({{a, b}}, 4, tiles);
  ASSERT_EQ(e.size(), 3u);
  EXPECT_DOUBLE_EQ(e[0].mean, (1.0 + 2.0 + 1.0 + 1.0) / 4.0);
  EXPECT_DOUBLE_EQ(e[0].variance_of_mean, 5.0 / 16.0);
  EXPECT_DOUBLE_EQ(e[0].degrees_of_freedom, 3.0 * 25.0 / 17.0 - 2.0);
  EXPECT_DOUBLE_EQ(e[1].variance_of_mean, 5.0 / 4.0);
  EXPECT_DOUBLE_EQ(e[2].variance_of_mean, 0.0);
}

TEST(TileEstimates, PixelsThatShareNoiseCountAsOne) {
  const Pixels a{Rgb(2), Rgb(4), Rgb(1), Rgb(3)};
  const Pixels b{Rgb(0), Rgb(0), Rgb(1), Rgb(1)};  // (A-B)/2 = 1, 2, 0, 1
  const auto tiles = bias_tiles(4, 1, {});
  // Squares of two pixels: sums 3 and 1.
  const auto squares = tile_estimates({{a, b}, false, 2}, 4, tiles);
  EXPECT_DOUBLE_EQ(squares[0].variance_of_mean, (9.0 + 1.0) / 16.0);
  // One square: sum 4, one degree of freedom.
  const auto whole = tile_estimates({{a, b}, false, 0}, 4, tiles);
  EXPECT_DOUBLE_EQ(whole[0].variance_of_mean, 1.0);
  EXPECT_DOUBLE_EQ(whole[0].degrees_of_freedom, 1.0);
}

TEST(TileEstimates, ExactReferenceHasNoVariance) {
  const Pixels truth{Rgb(2), Rgb(4)};
  const auto e = tile_estimates({{truth, truth}, true}, 2, bias_tiles(2, 1, {}));
  EXPECT_DOUBLE_EQ(e[0].mean, 3.0);
  EXPECT_EQ(e[0].variance_of_mean, 0.0);
  EXPECT_EQ(e[0].degrees_of_freedom, 0.0);
}

TEST(Replicates, ImageWithoutNoiseThatIsTheTruthHasNeitherVarianceNorBias) {
  const Pixels truth(64, Rgb(0.1f));
  const ReplicateSummary s =
      summary_of({truth, truth, truth, truth, truth}, {{truth, truth}, true}, 8);
  EXPECT_EQ(s.variance, 0.0);
  EXPECT_EQ(s.bias2, 0.0);
  EXPECT_FALSE(s.p_eff.has_value());
  ASSERT_TRUE(s.bias.has_value());
  EXPECT_FALSE(s.bias->rejected);
  EXPECT_TRUE(s.bias->relative_bias->shown_small);
  EfficiencyRow row;
  add_replicates(row, s);
  EXPECT_EQ(row.bias_tost, "shown");
  EXPECT_EQ(row.bias_smallest_p, 1.0);
}

/// Files of a result folder.
class RunPictures : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // A run whose picture is grey.
  RunRow put(int block, float value) {
    RunRow row = run("mis", block, 1.0, 0.5);
    row.seed = static_cast<std::uint64_t>(100 + block);
    row.width = 4;
    row.height = 2;
    write_run_picture(folder_, row, make_image(4, 2, Rgb(value)));
    return row;
  }
  static Reference reference() {
    Reference r;
    r.id = "r1";
    r.half_a = r.half_b = make_image(4, 2, Rgb(2.0f));
    return r;
  }

  std::filesystem::path folder_ = std::filesystem::temp_directory_path() /
                                  ("penumbra_replicates_test_" + std::to_string(::getpid()));
};

TEST_F(RunPictures, AreSummedUpOverTheRunsOfACell) {
  const std::vector<RunRow> rows{put(0, 1.0f), put(1, 3.0f)};
  const ReplicateSummary s = summarise_replicates(folder_, rows, reference()).value();
  EXPECT_EQ(s.count, 2);
  EXPECT_DOUBLE_EQ(s.variance, 2.0);
  EXPECT_DOUBLE_EQ(s.bias2, 0.0 - 2.0 / 2.0);
}

TEST_F(RunPictures, OfFailedRunsAndOfASecondAttemptAreLeftOut) {
  std::vector<RunRow> rows{put(0, 1.0f), put(1, 3.0f), put(2, 99.0f), put(3, 1.0f)};
  rows[2].status = RunStatus::Failed;
  rows[3].seed = rows[0].seed;
  EXPECT_EQ(summarise_replicates(folder_, rows, reference()).value().count, 2);
}

TEST_F(RunPictures, FewerThanTwoGiveNothing) {
  const std::vector<RunRow> rows{put(0, 1.0f), put(1, 3.0f)};
  std::filesystem::remove(run_picture(folder_, rows[1].run_id));
  EXPECT_FALSE(summarise_replicates(folder_, rows, reference()).has_value());
}

TEST_F(RunPictures, OfAnotherRunOrReferenceAreErrors) {
  std::vector<RunRow> rows{put(0, 1.0f), put(1, 3.0f)};
  std::filesystem::copy_file(run_picture(folder_, rows[0].run_id),
                             run_picture(folder_, rows[1].run_id),
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_THROW(summarise_replicates(folder_, rows, reference()), RunError);
  rows[0].reference_id = "r2";
  EXPECT_THROW(summarise_replicates(folder_, rows, reference()), ReferenceError);
}

TEST_F(RunPictures, TakeNoMoreSpaceThanPredicted) {
  std::mt19937_64 engine(1);  // bits that do not compress
  Image noise = make_image(96, 54);
  for (Rgb& pixel : noise.pixels) {
    for (int c = 0; c < 3; ++c) pixel[c] = static_cast<float>(engine() >> 40) * 0x1p-24f;
  }
  const RunRow row = put(0, 1.0f);
  write_run_picture(folder_, row, noise);
  const auto bytes =
      static_cast<double>(std::filesystem::file_size(run_picture(folder_, row.run_id)));
  EXPECT_LE(bytes, run_picture_bytes(96, 54));
  EXPECT_GE(bytes, 0.5 * run_picture_bytes(96, 54));
}

TEST_F(RunPictures, ReplicatePictureHoldsSpreadMeanAndBias) {
  const std::vector<RunRow> rows{put(0, 1.0f), put(1, 4.0f)};
  const ReplicateSummary s = summarise_replicates(folder_, rows, reference()).value();
  write_replicate_picture(folder_ / "s.exr", s, reference());
  const ExrFile exr = read_exr(folder_ / "s.exr");
  EXPECT_FLOAT_EQ(exr.image().pixels[0].x, std::sqrt(4.5f));
  EXPECT_FLOAT_EQ(exr.image("mean").pixels[0].x, 2.5f);
  EXPECT_FLOAT_EQ(exr.image("bias").pixels[7].z, 0.5f);
}

TEST(RowsOfCell, AreThoseOfItsLineInTheTable) {
  const std::vector<RunRow> rows = two_methods();
  const std::vector<EfficiencyRow> table = efficiency_table(rows, options());
  std::size_t found = 0;
  for (const EfficiencyRow& cell : table) {
    for (const RunRow& row : rows_of_cell(rows, cell)) {
      EXPECT_EQ(row.label, cell.label);
      ++found;
    }
  }
  EXPECT_EQ(found, rows.size());
}

}  // namespace
}  // namespace penumbra
