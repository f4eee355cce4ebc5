#include "harness/plan.h"
#include "harness/reference_manifest.h"
#include "harness/run_row.h"
#include "scenes/core/error.h"
#include "tests/fuzz/refusal.h"
#include "tests/fuzz/target.h"

namespace penumbra {

/// measurements.csv, perhaps of a writer that was killed. Once the torn line is cut off nothing is
/// torn, the same rows are there, and they survive being written and read back.
void fuzz_rows(const Sandbox& sandbox, std::string_view input) {
  const std::filesystem::path file = sandbox.write("rows.csv", input);
  RunRows rows;
  const bool accepted = accepts<InputError>(file.string(), [&] { rows = read_run_rows(file); });
  accepts<InputError>(file.string(), [&] { read_efficiency_rows(file); });
  if (!accepted) return;
  PN_CHECK(truncate_torn_tail(file) == rows.torn_tail, "a torn tail is cut off, nothing else");
  const RunRows whole = read_run_rows(file);
  PN_CHECK(!whole.torn_tail && whole.rows.size() == rows.rows.size(), "complete rows stay");
  std::string text = csv_line(run_columns());
  for (const RunRow& row : whole.rows) text += csv_line(run_record(row));
  const RunRows again = read_run_rows(sandbox.write("again.csv", text));
  PN_CHECK(again.rows.size() == whole.rows.size(), "rows that were written are read");
  for (std::size_t i = 0; i < again.rows.size(); ++i) {
    PN_CHECK(run_record(again.rows[i]) == run_record(whole.rows[i]), "a row reads back to itself");
  }
}

/// plan.lock.json of a result folder.
void fuzz_plan(const Sandbox& sandbox, std::string_view input) {
  const std::filesystem::path file = sandbox.write("plan.lock.json", input);
  accepts<InputError>(file.string(), [&] { read_plan_file(file); });
}

/// references/manifest.json of the project, asked about one reference.
void fuzz_manifest(const Sandbox& sandbox, std::string_view input) {
  sandbox.write("references/manifest.json", input);
  const std::filesystem::path file = sandbox.folder() / "references/small/box-1.exr";
  accepts<ReferenceError>(sandbox.folder().string(), [&] { check_small_reference(file, "1"); });
}

}  // namespace penumbra
