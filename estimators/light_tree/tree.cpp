#include "estimators/light_tree/tree.h"

#include "scenes/core/error.h"

namespace penumbra::light_tree {
namespace {

constexpr int kBuckets = 12;
// Radius of bounds that hold every point of a scene, whose diagonal is of order 1 to 10.
constexpr float kEverywhere = 1e6f;

// Bounds in double while they grow: a box and a cone.
struct Volume {
  Vec3d low{std::numeric_limits<double>::infinity()};
  Vec3d high{-std::numeric_limits<double>::infinity()};
  Vec3d axis{0.0};
  double angle{-1.0};  // half angle of the cone; negative: nothing yet
  double intensity{0.0};

  bool empty() const { return angle < 0.0; }
  Vec3d extent() const { return high - low; }
};

void add_cone(Volume& volume, Vec3d axis, double angle) {
  if (volume.empty()) {
    volume.axis = axis;
    volume.angle = angle;
    return;
  }
  if (angle > volume.angle) {
    std::swap(axis, volume.axis);
    std::swap(angle, volume.angle);
  }
  // Of the wider cone, and the narrower one. The angle between by atan2: acos has no digits near 0.
  const double between = std::atan2(volume.axis.cross(axis).length(), volume.axis.dot(axis));
  if (between + angle <= volume.angle) return;
  const double both = 0.5 * (volume.angle + between + angle);
  const Vec3d turned_about = volume.axis.cross(axis);
  if (both >= M_PI || !(turned_about.length() > 0.0)) {
    volume.angle = M_PI;
    return;
  }
  // The wider cone's axis, turned towards the other.
  const double turn = both - volume.angle;
  const Vec3d across = turned_about.cross(volume.axis).normalized();
  volume.axis = (volume.axis * std::cos(turn) + across * std::sin(turn)).normalized();
  volume.angle = both;
}

void add(Volume& volume, const Volume& other) {
  if (other.empty()) return;
  for (int axis = 0; axis < 3; ++axis) {
    volume.low[axis] = std::min(volume.low[axis], other.low[axis]);
    volume.high[axis] = std::max(volume.high[axis], other.high[axis]);
  }
  add_cone(volume, other.axis, other.angle);
  volume.intensity += other.intensity;
}

Volume volume_of(const Light& light) {
  Volume volume;
  volume.low = Vec3d(light.bounds_min);
  volume.high = Vec3d(light.bounds_max);
  volume.intensity = intensity_of(light);
  volume.axis = Vec3d(0.0, 0.0, 1.0);
  volume.angle = M_PI;
  if (light.two_sided) return volume;
  if (light.type == LightType::Rectangle) {
    volume.axis = light.plane_normal;
    volume.angle = 0.0;
  } else if (light.type == LightType::Mesh && light.normal_bounds.cosine > 0.0) {
    volume.axis = light.normal_bounds.axis;
    volume.angle = std::atan2(light.normal_bounds.sine, light.normal_bounds.cosine);
  }
  return volume;
}

Bounds bounds_of(const Volume& volume, bool no_bounds) {
  Bounds bounds;
  const Vec3d center = (volume.low + volume.high) * 0.5;
  bounds.center = Vec3(center);
  for (int axis = 0; axis < 3; ++axis) {
    // About the rounded centre, and not rounded down.
    const double half = 0.5 * (volume.high[axis] - volume.low[axis]) +
                        std::abs(static_cast<double>(bounds.center[axis]) - center[axis]);
    bounds.half_extent[axis] =
        std::nextafter(static_cast<float>(half), std::numeric_limits<float>::infinity());
  }
  if (no_bounds) bounds.half_extent = Vec3(kEverywhere);
  bounds.radius = bounds.half_extent.length();
  bounds.intensity = static_cast<float>(volume.intensity);
  if (volume.angle < 0.5 * M_PI && !no_bounds) {
    bounds.axis = Vec3(volume.axis);
    bounds.cosine = static_cast<float>(std::cos(volume.angle));
    bounds.sine = static_cast<float>(std::sin(volume.angle));
  }
  return bounds;
}

// What a child costs: the chance that its lights matter to a point, from the area of its box and
// the solid angle that its lights shine into, times their intensity.
// Source: Conty Estevez and Kulla 2018, section 4.4.
double cost_of(const Volume& volume) {
  if (volume.empty()) return 0.0;
  const double wide = std::min(volume.angle + 0.5 * M_PI, M_PI);
  const double o = volume.angle;
  const double solid_angle =
      2.0 * M_PI * (1.0 - std::cos(o)) + 0.5 * M_PI *
                                             (2.0 * wide * std::sin(o) - std::cos(o - 2.0 * wide) -
                                              2.0 * o * std::sin(o) + std::cos(o));
  const Vec3d e = volume.extent();
  // A row of lights has no area: the square of its length keeps rows of different length apart.
  const double area = e.x * e.y + e.y * e.z + e.z * e.x + 1e-3 * e.length2();
  return volume.intensity * solid_angle * area;
}

}  // namespace

double intensity_of(const Light& light) noexcept {
  const double facing = static_cast<double>(luminance(light.radiance)) * light.area;
  const bool is_flat = light.type == LightType::Rectangle;
  if (light.two_sided) return facing * 0.5;  // on average over the sphere
  // A convex body shows a quarter of its surface on average.
  return is_flat || light.normal_bounds.cosine > 0.0 ? facing : facing * 0.25;
}

struct Tree::Builder {
  struct Item {
    Volume volume;
    Vec3d middle;
    std::uint32_t light;
  };

  Tree& tree;
  bool no_bounds;
  std::vector<Item> items;
  std::size_t depth{0};

  // Makes node `at` of items [first, last).
  void build(std::uint32_t at, std::size_t first, std::size_t last, std::size_t level) {
    depth = std::max(depth, level);
    Volume all;
    for (std::size_t i = first; i < last; ++i) add(all, items[i].volume);
    tree.nodes_[at].bounds = bounds_of(all, no_bounds);
    if (last - first == 1) {
      tree.nodes_[at].light = items[first].light;
      return;
    }
    const std::size_t middle = split(first, last, all);
    const auto child = static_cast<std::uint32_t>(tree.nodes_.size());
    tree.nodes_.resize(tree.nodes_.size() + 2);
    tree.nodes_[at].first_child = child;
    build(child, first, middle, level + 1);
    build(child + 1, middle, last, level + 1);
  }

  // Partitions items by the cheapest of the planes between buckets; in the middle where there is
  // none.
  std::size_t split(std::size_t first, std::size_t last, const Volume& all) {
    Vec3d low(std::numeric_limits<double>::infinity());
    Vec3d high(-std::numeric_limits<double>::infinity());
    for (std::size_t i = first; i < last; ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], items[i].middle[axis]);
        high[axis] = std::max(high[axis], items[i].middle[axis]);
      }
    }
    const Vec3d extent = all.extent();
    const double longest = std::max({extent.x, extent.y, extent.z});
    double best = std::numeric_limits<double>::infinity();
    int best_axis = 0;
    int best_bucket = 0;
    const auto bucket_of = [&](const Item& item, int axis) {
      const double at = (item.middle[axis] - low[axis]) / (high[axis] - low[axis]);
      return std::min(static_cast<int>(at * kBuckets), kBuckets - 1);
    };
    for (int axis = 0; axis < 3; ++axis) {
      if (!(high[axis] > low[axis])) continue;
      Volume buckets[kBuckets];
      for (std::size_t i = first; i < last; ++i) {
        add(buckets[bucket_of(items[i], axis)], items[i].volume);
      }
      double behind[kBuckets];  // cost of the buckets behind each
      Volume tail;
      for (int b = kBuckets - 1; b > 0; --b) {
        add(tail, buckets[b]);
        behind[b - 1] = cost_of(tail);
      }
      Volume head;
      for (int b = 0; b + 1 < kBuckets; ++b) {
        add(head, buckets[b]);
        // Thin slabs are worse than cubes.
        const double cost = (cost_of(head) + behind[b]) * (longest / extent[axis]);
        if (cost < best) {
          best = cost;
          best_axis = axis;
          best_bucket = b;
        }
      }
    }
    const auto begin = items.begin() + static_cast<std::ptrdiff_t>(first);
    const auto end = items.begin() + static_cast<std::ptrdiff_t>(last);
    if (std::isfinite(best)) {
      const auto middle = std::partition(
          begin, end, [&](const Item& item) { return bucket_of(item, best_axis) <= best_bucket; });
      if (middle != begin && middle != end) {
        return static_cast<std::size_t>(middle - items.begin());
      }
    }
    return first + (last - first) / 2;
  }
};

Tree::Tree(std::span<const Light> lights, std::span<const std::uint32_t> members, bool no_bounds) {
  if (members.empty()) return;
  Builder builder{*this, no_bounds, {}};
  for (const std::uint32_t id : members) {
    const Light& light = lights[id];
    PN_CHECK(light.type == LightType::Rectangle || light.type == LightType::Sphere ||
                 light.type == LightType::Mesh,
             "a light tree is of shapes");
    const Volume volume = volume_of(light);
    builder.items.push_back({volume, (volume.low + volume.high) * 0.5, id});
  }
  nodes_.resize(1);
  builder.build(0, 0, members.size(), 1);
  pending_.reserve(builder.depth + 1);
  undecided_.reserve(builder.depth + 1);
}

void Tree::cut(const Vec3& point, const Vec3& normal, float split,
               std::vector<CutNode>& nodes) noexcept {
  nodes.clear();
  undecided_.clear();
  if (!empty()) undecided_.push_back({0, importance_of(0, point, normal)});
  while (!undecided_.empty()) {
    const CutNode at = undecided_.back();
    undecided_.pop_back();
    if (!(at.importance > 0.0f)) continue;
    const Node& node = nodes_[at.node];
    const float near = split * node.bounds.radius;
    if (node.first_child == 0 || !((node.bounds.center - point).length2() < near * near)) {
      nodes.push_back(at);
      continue;
    }
    for (const std::uint32_t child : {node.first_child + 1, node.first_child}) {
      undecided_.push_back({child, importance_of(child, point, normal)});
    }
  }
}

}  // namespace penumbra::light_tree
