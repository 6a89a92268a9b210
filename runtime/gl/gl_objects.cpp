#include "runtime/gl/gl_objects.h"

namespace daylit {

GlTexture make_texture(const Gl& gl, GLenum target) {
  GLuint name = 0;
  gl->CreateTextures(target, 1, &name);
  return {gl, name};
}

GlFramebuffer make_framebuffer(const Gl& gl) {
  GLuint name = 0;
  gl->CreateFramebuffers(1, &name);
  return {gl, name};
}

GlBuffer make_buffer(const Gl& gl, std::span<const std::byte> bytes) {
  GLuint name = 0;
  gl->CreateBuffers(1, &name);
  GlBuffer buffer(gl, name);
  refill_buffer(gl, buffer, bytes);
  return buffer;
}

void refill_buffer(const Gl& gl, const GlBuffer& buffer, std::span<const std::byte> bytes) {
  constexpr GLsizeiptr kSpare = 64; // so that an empty one can be bound, and its first element looked up
  const bool empty = bytes.empty();
  gl->NamedBufferData(buffer.name(), empty ? kSpare : static_cast<GLsizeiptr>(bytes.size()),
                      empty ? nullptr : bytes.data(), GL_DYNAMIC_DRAW);
}

GlVertexArray make_vertex_array(const Gl& gl, const GlBuffer& buffer, const std::vector<int>& components,
                                GLuint indices) {
  GLuint name = 0, location = 0, offset = 0;
  gl->CreateVertexArrays(1, &name);
  for (const int count : components) {
    gl->EnableVertexArrayAttrib(name, location);
    gl->VertexArrayAttribFormat(name, location, count, GL_FLOAT, GL_FALSE, offset);
    gl->VertexArrayAttribBinding(name, location++, 0);
    offset += static_cast<GLuint>(count) * static_cast<GLuint>(sizeof(float));
  }
  gl->VertexArrayVertexBuffer(name, 0, buffer.name(), 0, static_cast<GLsizei>(offset));
  if (indices)
    gl->VertexArrayElementBuffer(name, indices);
  return {gl, name};
}

namespace {

Error shader_error(const std::string& name, const char* stage, const std::string& log) {
  return {ErrorCode::device, std::string(stage) + " failed: " + log, "shader " + name,
          "report this with the name and version of the graphics driver"};
}

/// Attaches one compiled stage; the shader object itself lives as long as the program.
Result<void> attach_stage(const Gl& gl, GLuint program, const std::string& name, GLenum type,
                          const std::vector<const char*>& parts) {
  std::vector<const char*> source{"#version 450 core\n"};
  source.insert(source.end(), parts.begin(), parts.end());
  const GLuint shader = gl->CreateShader(type);
  gl->ShaderSource(shader, static_cast<GLsizei>(source.size()), source.data(), nullptr);
  gl->CompileShader(shader);
  GLint compiled = 0;
  gl->GetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
  std::string log(2000, '\0');
  if (!compiled) {
    GLsizei length = 0;
    gl->GetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), &length, log.data());
    log.resize(static_cast<std::size_t>(length));
  } else {
    gl->AttachShader(program, shader);
  }
  gl->DeleteShader(shader);
  if (!compiled)
    return shader_error(name, "compiling", log);
  return {};
}

} // namespace

Result<GlProgram> make_program(const Gl& gl, const std::string& name, const std::vector<const char*>& vertex_parts,
                               const std::vector<const char*>& fragment_parts) {
  GlProgram program(gl, gl->CreateProgram());
  if (const auto r = attach_stage(gl, program.name(), name + " (vertex)", GL_VERTEX_SHADER, vertex_parts); !r)
    return r.error();
  if (const auto r = attach_stage(gl, program.name(), name + " (fragment)", GL_FRAGMENT_SHADER, fragment_parts); !r)
    return r.error();
  gl->LinkProgram(program.name());
  GLint linked = 0;
  gl->GetProgramiv(program.name(), GL_LINK_STATUS, &linked);
  if (!linked) {
    std::string log(2000, '\0');
    GLsizei length = 0;
    gl->GetProgramInfoLog(program.name(), static_cast<GLsizei>(log.size()), &length, log.data());
    log.resize(static_cast<std::size_t>(length));
    return shader_error(name, "linking", log);
  }
  return program;
}

Result<void> check_framebuffer(const Gl& gl, const GlFramebuffer& framebuffer, const std::string& where) {
  const GLenum status = gl->CheckNamedFramebufferStatus(framebuffer.name(), GL_FRAMEBUFFER);
  if (status == GL_FRAMEBUFFER_COMPLETE)
    return check_gl(*gl, where);
  return Error{ErrorCode::device, "framebuffer incomplete (code " + std::to_string(status) + ")", where,
               "the graphics driver lacks a required format: use another"};
}

} // namespace daylit
