#pragma once

// Declarations alone; the implementation is the distribution's shared library.
#include <tiny_gltf.h>
