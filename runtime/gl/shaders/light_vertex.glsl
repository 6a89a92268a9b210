flat out vec4 sphere; // w: radius
void main() {
  gl_Position = whole_picture(kAllMarked);
  sphere = frame.sphere;
  HAND_ON_WINDOWS
  HAND_ON_BATCH
}
