#pragma once

// tinygltf without its picture decoders and file access: pictures and files are read by this project's own code.

#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_FS
#include <tiny_gltf.h>
