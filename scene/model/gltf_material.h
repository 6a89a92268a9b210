#pragma once

#include <map>
#include <string>

#include "scene/format/gltf_model.h"
#include "scene/model/surface_list.h"

namespace daylit::detail {

/// Materials of a glTF file, each read when it is first asked for.
class GltfMaterials {
public:
  struct Found {
    std::uint32_t material = 0; ///< of the list
    int uv_set = 0;             ///< TEXCOORD_n that its textures use
  };

  /// `fallback`: reflectance where a primitive has no material. What is referred to must outlive this.
  GltfMaterials(const tinygltf::Model& model, const std::string& name, Rgb fallback, SurfaceList& list)
      : model_(model), name_(name), fallback_(fallback), list_(list) {}

  /// `index`: of the file's materials, below 0: none. Errors: it, or what it names, is not there or cannot be read; a
  /// number out of its range.
  Result<Found> at(int index);

private:
  Result<Found> read(int index);

  const tinygltf::Model& model_;
  const std::string& name_;
  Rgb fallback_;
  SurfaceList& list_;
  std::map<int, Found> known_;
};

} // namespace daylit::detail
