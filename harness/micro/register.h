#pragma once

#include "harness/micro/suite.h"

/// Registration of the microbenchmarks, each group in a file of its own. The suite must outlive the
/// run. Every kernel is checked before it is timed (checks.h).
namespace penumbra::micro {

/// adapt/...: count rounding, the minimum of counts, sums of Eq. 6, cone fit, mixture density, over
/// population size and number of components; and adaptation next to whole estimates.
void register_adaptation_kernels(Suite& suite);
void register_adaptation_shares(Suite& suite);

/// alsd/...: evidence, probabilities and the draw of counts, over lights.
void register_alsd_kernels(Suite& suite);

/// mdhi/...: insertion, search of the worst leaf and splits, over samples.
void register_mdhi_kernels(Suite& suite);

/// sampler/...: point sets of every kind, over points.
void register_sampler_kernels(Suite& suite);

/// light/...: proposals of every type of light with a density over directions, and the one
/// direction to lights without extent.
void register_light_kernels(Suite& suite);
void register_delta_light_kernels(Suite& suite);

/// bsdf/...: sampling and evaluation of every type of material.
void register_bsdf_kernels(Suite& suite);

/// rays/...: batch queries of camera, cosine and shadow rays, by scene.
void register_ray_kernels(Suite& suite);

/// estimate/<name>/<scene>/srl:<A-B>: whole estimates of every registered estimator.
void register_estimates(Suite& suite);

}  // namespace penumbra::micro
