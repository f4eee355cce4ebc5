// Compiled by a test with -ffast-math, which has to be refused, and without.

#include "scenes/core/vec.h"

int main() { return 0; }
