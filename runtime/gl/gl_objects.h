#pragma once

// Owning handles of OpenGL objects. Each keeps the functions of its context alive and must die while that context is
// current; the renderer that owns them sees to both.

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "runtime/gl/gl_functions.h"

namespace daylit {

using Gl = std::shared_ptr<const GlFunctions>;

enum class GlKind { texture, buffer, framebuffer, vertex_array, program };

template <GlKind kind>
class GlHandle {
public:
  GlHandle() = default;
  GlHandle(Gl gl, GLuint name) : gl_(std::move(gl)), name_(name) {}
  GlHandle(GlHandle&& other) noexcept : gl_(std::move(other.gl_)), name_(std::exchange(other.name_, 0)) {}
  GlHandle& operator=(GlHandle&& other) noexcept {
    std::swap(gl_, other.gl_);
    std::swap(name_, other.name_);
    return *this;
  }
  ~GlHandle() {
    if (!name_ || gl_->lost)
      return;
    if constexpr (kind == GlKind::texture)
      gl_->DeleteTextures(1, &name_);
    else if constexpr (kind == GlKind::buffer)
      gl_->DeleteBuffers(1, &name_);
    else if constexpr (kind == GlKind::framebuffer)
      gl_->DeleteFramebuffers(1, &name_);
    else if constexpr (kind == GlKind::vertex_array)
      gl_->DeleteVertexArrays(1, &name_);
    else
      gl_->DeleteProgram(name_);
  }
  GLuint name() const { return name_; }
  explicit operator bool() const { return name_ != 0; }

private:
  Gl gl_;
  GLuint name_ = 0;
};

using GlTexture = GlHandle<GlKind::texture>;
using GlBuffer = GlHandle<GlKind::buffer>;
using GlFramebuffer = GlHandle<GlKind::framebuffer>;
using GlVertexArray = GlHandle<GlKind::vertex_array>;
using GlProgram = GlHandle<GlKind::program>;

GlTexture make_texture(const Gl& gl, GLenum target);
GlFramebuffer make_framebuffer(const Gl& gl);
/// A new buffer with these bytes; a few spare bytes when empty, so that it can always be bound.
GlBuffer make_buffer(const Gl& gl, std::span<const std::byte> bytes);
void refill_buffer(const Gl& gl, const GlBuffer& buffer, std::span<const std::byte> bytes);

/// Float attributes at locations 0, 1, ... with the given component counts, interleaved in one buffer. `indices` 0:
/// drawn without.
GlVertexArray make_vertex_array(const Gl& gl, const GlBuffer& buffer, const std::vector<int>& components,
                                GLuint indices = 0);

/// Compiles and links one vertex and one fragment shader, each the concatenation of its parts after "#version 450
/// core". Error device with the compiler's log.
Result<GlProgram> make_program(const Gl& gl, const std::string& name, const std::vector<const char*>& vertex_parts,
                               const std::vector<const char*>& fragment_parts);
Result<void> check_framebuffer(const Gl& gl, const GlFramebuffer& framebuffer, const std::string& where);

} // namespace daylit
