#include "harness/metric_columns.h"

#include <array>

namespace penumbra {
namespace {

struct Field {
  std::string_view metric;
  std::optional<double> RunRow::*member;
};

constexpr std::array kFields{
    Field{"mse", &RunRow::mse},       Field{"mse_naive", &RunRow::mse_naive},
    Field{"relmse", &RunRow::relmse}, Field{"relmse_trim", &RunRow::relmse_trim},
    Field{"mape", &RunRow::mape},     Field{"mean_error", &RunRow::mean_error},
    Field{"p_eff", &RunRow::p_eff},   Field{"reference_share", &RunRow::reference_share}};

}  // namespace

std::optional<double> RunRow::*metric_field(std::string_view metric) {
  for (const Field& field : kFields) {
    if (field.metric == metric) return field.member;
  }
  return nullptr;
}

void record_metrics(const ImageMetrics& metrics, RunRow& row) {
  for (const MetricInfo& metric : metric_table()) {
    if (const auto field = metric_field(metric.name)) row.*field = metric.value(metrics);
  }
  row.reference_mean = metrics.reference.mean;
  row.reference_mean_se = metrics.reference.mean_se;
  row.reference_floor = metrics.reference.floor;
}

}  // namespace penumbra
