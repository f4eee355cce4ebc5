#pragma once

// Debian builds the library with coordinates in double precision under a name of its own; the
// switch must agree with it.
#define TINYOBJLOADER_USE_DOUBLE
#include <tiny_obj_loader.h>
