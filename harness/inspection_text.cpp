#include <fmt/format.h>

#include <algorithm>

#include "harness/inspection.h"
#include "harness/inspection_lights.h"

namespace penumbra {
namespace {

constexpr std::size_t kMostLightsShown = 12;

std::string triple(const Vec3d& v) { return fmt::format("({:g}, {:g}, {:g})", v.x, v.y, v.z); }

std::string light_line(const Light& light, const SceneTraits& t) {
  std::string line = fmt::format("    {:<12} {:<11} ", light.name, type_name(light.type));
  if (light.type == LightType::Directional) {
    line += fmt::format("irradiance {} W/m^2 along {}\n", triple(Vec3d(light.irradiance)),
                        triple(light.axis));
  } else if (light.is_delta()) {
    line += fmt::format("intensity {} W/sr at {}", triple(world_intensity(light, t)),
                        triple(world_position(light, t)));
    if (light.type == LightType::Spot) {
      line += fmt::format(" along {}, half angles {:g} and {:g} degrees", triple(light.axis),
                          half_angle_deg(light.inner_depth), half_angle_deg(light.outer_depth));
    }
    line += "\n";
  } else if (light.type == LightType::Environment) {
    const Environment& e = light.environment;
    line +=
        fmt::format("{} x {} texels, {} W/m^2 over all directions, {:.1f} kB\n", e.columns(),
                    e.rows(), triple(e.power()), static_cast<double>(e.memory_bytes()) / 1024.0);
  } else {
    line += fmt::format("radiance {} W/(m^2 sr), area {:.4g}, {}\n", triple(Vec3d(light.radiance)),
                        world_area(light, t), light.two_sided ? "two-sided" : "one-sided");
  }
  return line;
}

std::string bytes_text(double bytes) {
  if (bytes >= 1048576.0) return fmt::format("{:.1f} MB", bytes / 1048576.0);
  if (bytes >= 1024.0) return fmt::format("{:.1f} kB", bytes / 1024.0);
  return fmt::format("{:.0f} B", bytes);
}

std::string scene_text(const Inspection& inspection) {
  const Scene& scene = *inspection.scene;
  const SceneTraits& t = scene.traits();
  std::string text = fmt::format("scene {}  (content {})\n", scene.name(), scene.content_hash());
  text += fmt::format("  geometry     {} triangles, {} spheres, {} in the ray tracer{}\n",
                      t.triangles, t.spheres, bytes_text(static_cast<double>(t.ray_scene_bytes)),
                      t.geometry == "own" ? "" : ", " + t.geometry);
  const LoadTimes& load = inspection.load;
  text += fmt::format(
      "  loading      {:.1f} ms reading, {:.1f} ms building ({:.1f} ms of it Embree), {} at most\n",
      load.read_s * 1e3, load.build_s * 1e3, load.ray_scene_s * 1e3,
      bytes_text(static_cast<double>(load.peak_bytes)));
  text += fmt::format("  scale        {} scene units per world unit, centre {}, diagonal {:.3g}\n",
                      t.scale, triple(t.center), t.diagonal);
  text += fmt::format("  materials    {}{}, sharpest glossy lobe alpha {:g}\n", t.materials,
                      t.all_diffuse ? ", all diffuse" : "", static_cast<double>(t.min_alpha));
  text += fmt::format(
      "  lights       {}: {} rectangles, {} spheres, {} meshes, {} points, {} spots, {} "
      "directional, {} environment\n",
      scene.lights().size(), t.rectangle_lights, t.sphere_lights, t.mesh_lights, t.point_lights,
      t.spot_lights, t.directional_lights, t.has_environment ? "an" : "no");
  const std::size_t shown = std::min(scene.lights().size(), kMostLightsShown);
  for (const Light& light : scene.lights().first(shown)) text += light_line(light, t);
  if (shown < scene.lights().size()) {
    text += fmt::format("    and {} more\n", scene.lights().size() - shown);
  }
  const ShadingPoints& points = inspection.points;
  text += fmt::format(
      "  points       {} x {}, {:.1f} % of the pixel centres can reflect light\n", points.width,
      points.height,
      100.0 * static_cast<double>(points.valid_count) / static_cast<double>(points.points.size()));
  return text;
}

std::string parts_text(const Inspection& inspection) {
  std::string text =
      fmt::format("\nparts{:<23}{:<10} {:<54}{:>10} {:>10}\n", "", "", "why", "bytes", "ms");
  double saved_bytes = 0.0;
  double saved_ms = 0.0;
  for (const InspectedPart& part : inspection.parts) {
    text += fmt::format("  {:<26}{:<10} {:<54}{:>10} {:>10.2f}\n", part.name,
                        part.present ? "present" : "left out", part.why, bytes_text(part.bytes),
                        part.build_ms);
    if (part.present) continue;
    saved_bytes += part.bytes;
    saved_ms += part.build_ms;
  }
  text += fmt::format("  left out: {} and {:.1f} ms, as measured by building it now\n",
                      bytes_text(saved_bytes), saved_ms);
  return text;
}

std::string components_text(const Inspection& inspection) {
  const InspectedComponents& c = inspection.components;
  std::string text = "\ncomponents of mixtures, means over the points\n";
  text += fmt::format(
      "  lights       {:.2f} of {:.0f} can contribute; the others are below the horizon, seen from "
      "behind or black\n",
      c.lights_that_can, c.lights);
  text += fmt::format("  BSDF         at {:.1f} % of the points{}\n", 100.0 * c.points_that_can,
                      c.points_in_mirrors > 0.0
                          ? fmt::format(", {:.1f} % are in mirrors", 100.0 * c.points_in_mirrors)
                          : "");
  text += fmt::format(
      "  cone         at {:.1f} % of the points something may lie in front of a light (pmc_hi)\n",
      100.0 * c.points_with_occluder);
  return text;
}

std::string estimators_text(const Inspection& inspection) {
  std::string text = fmt::format(
      "\nestimates at SRL {}, one thread: as the scene needs it | with everything kept\n"
      "  {:<10}{:>9}{:>9}{:>12}{:>9}{:>11} |{:>9}{:>9}{:>12}{:>9}{:>11}\n",
      inspection.srl, "", "samples", "rays", "rays/lit", "ns", "scratch", "samples", "rays",
      "rays/lit", "ns", "scratch");
  const auto work = [](const InspectedWork& w) {
    return fmt::format("{:>9.1f}{:>9.1f}{:>12.2f}{:>9.0f}{:>11}", w.samples, w.rays,
                       w.rays_per_lit(), w.time_ns, bytes_text(w.scratch_bytes));
  };
  for (const InspectedEstimator& e : inspection.estimators) {
    text += fmt::format("  {:<10}{} |{}\n", e.name, work(e.lean), work(e.kept));
  }
  text += "  rays/lit: rays traced for one that brings light\n";
  text += "\nwhere the time goes, one thread, independent points\n";
  text += cost_splits_text(inspection.costs);
  return text;
}

}  // namespace

std::string inspection_text(const Inspection& inspection) {
  return scene_text(inspection) + parts_text(inspection) + components_text(inspection) +
         estimators_text(inspection);
}

}  // namespace penumbra
