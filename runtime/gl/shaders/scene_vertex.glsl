// Every pass that draws triangles into the picture, so that depths compare equal between passes.
layout(location = 0) in vec3 position;
invariant gl_Position;
void main() { gl_Position = frame.clip_from_scene * vec4(position, 1.0); }
