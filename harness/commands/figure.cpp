#include "harness/figure.h"

#include <fmt/format.h>

#include "harness/commands/commands.h"

namespace penumbra {

int figure_command(const FigureCommandOptions& options) {
  write_figure(options.folder, make_report(options.folder, ReplicatePictures::Leave),
               options.figure);
  fmt::print("figure: {}\n", options.figure.out.string());
  return kSuccess;
}

}  // namespace penumbra
