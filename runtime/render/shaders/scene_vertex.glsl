// Shared by every pass that draws into the picture, so that depths compare equal between passes.
uniform mat4 clip_from_scene;
invariant gl_Position;
vec4 clip_position(vec3 p) { return clip_from_scene * vec4(p, 1.0); }
