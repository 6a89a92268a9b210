#include "scene/placing/read_object.h"

#include "scene/material/library.h"
#include "scene/model/mesh_edit.h"

namespace daylit {

Result<ObjectMesh> read_object(const ObjectConfig& object, std::vector<std::string>* notes) {
  auto mesh = read_object_mesh(object.model, Rgb(0.7f), notes);
  if (!mesh)
    return mesh;
  wind_by_normals(*mesh);
  if (object.material.empty() && !object.reflectance)
    return mesh;
  ObjectMaterial material;
  if (!object.material.empty()) {
    const auto named = library_material(object.material);
    if (!named)
      return named.error();
    material = *named;
  }
  if (object.reflectance)
    material.base_colour = *object.reflectance;
  give_material(*mesh, std::move(material));
  return mesh;
}

} // namespace daylit
