#pragma once

#include <functional>

#include "scenes/core/scene_description.h"

/// Closed meshes from implicit surfaces.
namespace penumbra {

/// Negative inside, positive outside; near the surface roughly the distance to it. Called from many
/// threads.
using Field = std::function<double(const Vec3d&)>;

/// A box in which a field is sampled on a cubic lattice.
struct FieldBox {
  Vec3d low, high;  ///< the field is positive on the faces
  double cell{0};   ///< side of a cell
};

/// Polygonises a field by marching tetrahedra: each cell of the lattice is cut into the six
/// tetrahedra of Kuhn around its diagonal, so that neighbours share faces, and every lattice edge
/// whose ends have different signs carries one vertex. The surface of such a labelling of a
/// triangulated space is a closed manifold whatever the field, without the ambiguous cases of
/// marching cubes. Vertices are kept away from the lattice points, so that no triangle degenerates,
/// and then moved onto the surface along the gradient; vertex normals are the gradient's.
///
/// Only the largest connected part is kept: where a field is cut by another, crumbs may be left.
///
/// The same bits on any number of threads. Coordinates are rounded to 2^-20, so that a difference
/// in the last digit of a machine's mathematical functions is not likely to show, and references of
/// scenes with the mesh can be found by their content hash elsewhere.
/// Source: Doi and Koide 1991, "An efficient method of triangulating equi-valued surfaces by using
/// tetrahedral cells"; Kuhn 1960, "Some combinatorial lemmas in topology".
TriangleMeshShape polygonise(const Field& field, const FieldBox& box);

}  // namespace penumbra
