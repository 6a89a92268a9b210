// The body of the one-header glTF library: no file system, no image decoder, no writer of its own.

#include <fstream> // the header forgets it without a file system

#define TINYGLTF_IMPLEMENTATION
#include "scene/format/gltf_library.h"
