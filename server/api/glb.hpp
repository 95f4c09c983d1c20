// glb: a mesh as a binary glTF 2.0 file: a node for each cell ("cell 17") with its nucleus as a child, one material an activity.
// Units:   1 unit = 1 um, y up (glTF's convention): the root node turns the colony, whose z points up. `extras` of the asset say so.
//          (glTF means metres; a colony of 0.0001 m lies before every viewer's near plane.)
// Shapes:  one buffer with positions, normals and indices; the accessors of a part point into it.
// Errors:  kInternal if the writer refuses. A colony without surfaces is a scene without meshes.
// Threads: pure.
#pragma once

#include <string>

#include "engine/picture/mesh.hpp"

namespace colony::server::api {

Result<std::string> encode_glb(const Mesh& mesh, const Colony& colony);

}  // namespace colony::server::api
