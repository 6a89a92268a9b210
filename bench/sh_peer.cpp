#include "bench/sh_peer.h"

#include <dlfcn.h>

namespace daylit::bench {

Result<ShPeer> ShPeer::load(const std::string& path) {
  ShPeer peer;
  void* handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!handle)
    return Error{ErrorCode::file_missing, dlerror(), path, "give the path of a shared object"};
  peer.library_ = std::shared_ptr<void>(handle, [](void* h) { dlclose(h); });
  peer.synthesis = reinterpret_cast<Synthesis>(dlsym(handle, "sht_synthesis"));
  peer.analysis = reinterpret_cast<Analysis>(dlsym(handle, "sht_analysis"));
  if (!peer.synthesis || !peer.analysis)
    return Error{ErrorCode::file_malformed, "no functions sht_synthesis and sht_analysis", path,
                 "see docs/sh.md for the interface"};
  return peer;
}

} // namespace daylit::bench
