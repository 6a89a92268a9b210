#pragma once

// The OpenGL 4.5 core entry points that the renderer uses, loaded through any resolver: no link-time libGL, because
// EGL, OSMesa and GLFW contexts each bring their own.

#include <functional>
#include <string>

#include <GL/glcorearb.h>

#include "scene/core/result.h"

#define DAYLIT_GL_FUNCTIONS(X)                                                                                         \
  X(ATTACHSHADER, AttachShader)                                                                                        \
  X(BINDBUFFERBASE, BindBufferBase)                                                                                    \
  X(BINDFRAMEBUFFER, BindFramebuffer)                                                                                  \
  X(BINDTEXTUREUNIT, BindTextureUnit)                                                                                  \
  X(BINDVERTEXARRAY, BindVertexArray)                                                                                  \
  X(BLITNAMEDFRAMEBUFFER, BlitNamedFramebuffer)                                                                        \
  X(CHECKNAMEDFRAMEBUFFERSTATUS, CheckNamedFramebufferStatus)                                                          \
  X(CLEARNAMEDFRAMEBUFFERFV, ClearNamedFramebufferfv)                                                                  \
  X(CLIPCONTROL, ClipControl)                                                                                          \
  X(COLORMASK, ColorMask)                                                                                              \
  X(COMPILESHADER, CompileShader)                                                                                      \
  X(CREATEBUFFERS, CreateBuffers)                                                                                      \
  X(CREATEFRAMEBUFFERS, CreateFramebuffers)                                                                            \
  X(CREATEPROGRAM, CreateProgram)                                                                                      \
  X(CREATESHADER, CreateShader)                                                                                        \
  X(CREATETEXTURES, CreateTextures)                                                                                    \
  X(CREATEVERTEXARRAYS, CreateVertexArrays)                                                                            \
  X(DELETEBUFFERS, DeleteBuffers)                                                                                      \
  X(DELETEFRAMEBUFFERS, DeleteFramebuffers)                                                                            \
  X(DELETEPROGRAM, DeleteProgram)                                                                                      \
  X(DELETESHADER, DeleteShader)                                                                                        \
  X(DELETETEXTURES, DeleteTextures)                                                                                    \
  X(DELETEVERTEXARRAYS, DeleteVertexArrays)                                                                            \
  X(DEPTHFUNC, DepthFunc)                                                                                              \
  X(DEPTHMASK, DepthMask)                                                                                              \
  X(DISABLE, Disable)                                                                                                  \
  X(DRAWARRAYS, DrawArrays)                                                                                            \
  X(DRAWELEMENTS, DrawElements)                                                                                        \
  X(ENABLE, Enable)                                                                                                    \
  X(ENABLEVERTEXARRAYATTRIB, EnableVertexArrayAttrib)                                                                  \
  X(GETERROR, GetError)                                                                                                \
  X(GETGRAPHICSRESETSTATUS, GetGraphicsResetStatus)                                                                    \
  X(GETINTEGERV, GetIntegerv)                                                                                          \
  X(GETPROGRAMINFOLOG, GetProgramInfoLog)                                                                              \
  X(GETPROGRAMIV, GetProgramiv)                                                                                        \
  X(GETSHADERINFOLOG, GetShaderInfoLog)                                                                                \
  X(GETSHADERIV, GetShaderiv)                                                                                          \
  X(GETSTRING, GetString)                                                                                              \
  X(GETTEXTUREIMAGE, GetTextureImage)                                                                                  \
  X(GETUNIFORMLOCATION, GetUniformLocation)                                                                            \
  X(LINKPROGRAM, LinkProgram)                                                                                          \
  X(NAMEDBUFFERDATA, NamedBufferData)                                                                                  \
  X(NAMEDFRAMEBUFFERDRAWBUFFER, NamedFramebufferDrawBuffer)                                                            \
  X(NAMEDFRAMEBUFFERDRAWBUFFERS, NamedFramebufferDrawBuffers)                                                          \
  X(NAMEDFRAMEBUFFERREADBUFFER, NamedFramebufferReadBuffer)                                                            \
  X(NAMEDFRAMEBUFFERTEXTURE, NamedFramebufferTexture)                                                                  \
  X(NAMEDFRAMEBUFFERTEXTURELAYER, NamedFramebufferTextureLayer)                                                        \
  X(PROGRAMUNIFORM1F, ProgramUniform1f)                                                                                \
  X(PROGRAMUNIFORM3FV, ProgramUniform3fv)                                                                              \
  X(SHADERSOURCE, ShaderSource)                                                                                        \
  X(TEXTUREPARAMETERI, TextureParameteri)                                                                              \
  X(TEXTURESTORAGE2D, TextureStorage2D)                                                                                \
  X(TEXTURESTORAGE2DMULTISAMPLE, TextureStorage2DMultisample)                                                          \
  X(TEXTURESTORAGE3D, TextureStorage3D)                                                                                \
  X(TEXTURESUBIMAGE2D, TextureSubImage2D)                                                                              \
  X(USEPROGRAM, UseProgram)                                                                                            \
  X(VERTEXARRAYATTRIBBINDING, VertexArrayAttribBinding)                                                                \
  X(VERTEXARRAYATTRIBFORMAT, VertexArrayAttribFormat)                                                                  \
  X(VERTEXARRAYELEMENTBUFFER, VertexArrayElementBuffer)                                                                \
  X(VERTEXARRAYVERTEXBUFFER, VertexArrayVertexBuffer)                                                                  \
  X(VIEWPORT, Viewport)

namespace daylit {

/// Member names are the GL names without their prefix. Valid while the context that resolved them is current.
struct GlFunctions {
#define DAYLIT_GL_MEMBER(TYPE, NAME) PFNGL##TYPE##PROC NAME = nullptr;
  DAYLIT_GL_FUNCTIONS(DAYLIT_GL_MEMBER)
#undef DAYLIT_GL_MEMBER
  /// Set when the context is gone for good: what it held went with it, no object is deleted any more.
  mutable bool lost = false;
};

/// Error device: lists the entry points that the driver lacks.
Result<GlFunctions> load_gl(const std::function<void*(const char*)>& resolve);

/// Error device naming the GL error code when one is pending since the last call, or when the graphics processor was
/// reset.
Result<void> check_gl(const GlFunctions& gl, const std::string& where);

} // namespace daylit
