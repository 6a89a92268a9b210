// The body of the one-header glTF library: no file system, no image decoder, no writer of its own.

#include <fstream> // the header forgets it without a file system

#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_FS
#include <tiny_gltf.h>
