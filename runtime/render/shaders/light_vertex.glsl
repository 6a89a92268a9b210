flat out vec4 sphere; // w: radius
void main() {
  gl_Position = whole_picture(kMixedMark) /* the less of the two */;
  sphere = frame.sphere;
  HAND_ON_WINDOWS
  HAND_ON_BATCH
}
