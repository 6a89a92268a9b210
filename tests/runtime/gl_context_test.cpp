// Where OpenGL comes from, and what happens when it goes.

#include <EGL/egl.h>
#include <gtest/gtest.h>

#include "runtime/gl/gl_functions.h"
#include "runtime/gl/renderer.h"
#include "test_session.h"

namespace daylit {
namespace {

using test::is_sound;
using test::Studio;

TEST(GlContexts, egl_and_osmesa_draw_the_same_picture) {
  if (!create_osmesa_context())
    GTEST_SKIP() << "no OSMesa here";
  Studio studio;
  const auto egl = studio.render(Backend::opengl), osmesa = studio.render(Backend::osmesa);
  ASSERT_TRUE(egl && osmesa);
  std::size_t same = 0;
  const float white = 0.4f; // of the photograph
  for (std::size_t i = 0; i < studio.photo.texels.size(); ++i) {
    const Rgb d = glm::abs(egl->composite.picture.texels[i] - osmesa->composite.picture.texels[i]);
    same += std::max({d.r, d.g, d.b}) <= white / 255.0f;
  }
  EXPECT_GE(static_cast<double>(same), 0.999 * static_cast<double>(studio.photo.texels.size()));
}

/// Everything a real context does, except that shaders get a line more that no compiler takes.
class SpoiltShaders : public GlContext {
public:
  explicit SpoiltShaders(std::unique_ptr<GlContext> real) : real_(std::move(real)) {
    original = reinterpret_cast<PFNGLSHADERSOURCEPROC>(real_->resolve("glShaderSource"));
  }
  Result<void> make_current() override { return real_->make_current(); }
  void* resolve(const char* name) override {
    return std::string(name) == "glShaderSource" ? reinterpret_cast<void*>(&spoilt) : real_->resolve(name);
  }
  std::string backend() const override { return real_->backend(); }

private:
  static inline PFNGLSHADERSOURCEPROC original = nullptr;
  static void APIENTRY spoilt(GLuint shader, GLsizei count, const GLchar* const* strings, const GLint*) {
    std::vector<const char*> all(strings, strings + count);
    all.push_back("\nfloat daylight = vec3(1.0) * no_such_name;\n");
    original(shader, static_cast<GLsizei>(all.size()), all.data(), nullptr);
  }
  std::unique_ptr<GlContext> real_;
};

TEST(GlContexts, a_shader_that_does_not_compile_is_an_error_with_the_compilers_words) {
  auto context = create_gl_context();
  ASSERT_TRUE(context) << context.error().message();
  const auto renderer =
      Renderer::make(std::make_unique<SpoiltShaders>(std::move(*context)), test::box_room(), test::box_window());
  ASSERT_FALSE(renderer);
  EXPECT_EQ(renderer.error().code, ErrorCode::device);
  EXPECT_NE(renderer.error().message().find("no_such_name"), std::string::npos) << renderer.error().message();
  EXPECT_NE(renderer.error().message().find("shader shadow"), std::string::npos) << renderer.error().message();
}

TEST(GlContexts, after_its_context_is_destroyed_a_session_says_so_and_starts_again) {
  Studio studio;
  auto session = studio.open(Backend::opengl);
  ASSERT_TRUE(session) << session.error().message();
  const auto before = studio.render(*session);
  ASSERT_TRUE(before) << before.error().message();

  const EGLDisplay display = eglGetCurrentDisplay();
  const EGLContext context = eglGetCurrentContext();
  ASSERT_NE(context, EGL_NO_CONTEXT);
  ASSERT_TRUE(eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT));
  ASSERT_TRUE(eglDestroyContext(display, context));
  studio.sky.radiance[0] *= 1.5f; // something is to be drawn again
  const auto lost = studio.render(*session);
  ASSERT_FALSE(lost);
  EXPECT_EQ(lost.error().code, ErrorCode::device);
  EXPECT_NE(lost.error().message().find("create the renderer again"), std::string::npos) << lost.error().message();

  const auto again = session->recreate_renderer();
  ASSERT_TRUE(again) << again.error().message();
  studio.sky.radiance[0] /= 1.5f;
  const auto after = studio.render(*session);
  ASSERT_TRUE(after) << after.error().message();
  EXPECT_EQ(0, std::memcmp(before->composite.picture.texels.data(), after->composite.picture.texels.data(),
                           studio.photo.texels.size() * sizeof(Rgb)));
}

} // namespace
} // namespace daylit
