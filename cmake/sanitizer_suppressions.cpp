// What the sanitizers report about libraries that are not instrumented; linked into every program and test of the
// sanitizer presets, so that it holds for programs that tests start, too.

extern "C" const char* __tsan_default_options();
extern "C" const char* __tsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions();
extern "C" int dlclose(void* library);

/// Libraries stay loaded: a report about one that is gone names no library, and nothing could be suppressed.
extern "C" int dlclose(void*) { return 0; }

extern "C" const char* __tsan_default_options() { return "halt_on_error=1"; }

/// nptl_deallocate_tsd: workers of TBB that end after OpenCV's statics are gone still hold data of these.
extern "C" const char* __tsan_default_suppressions() {
  return "race:swrast_dri.so\n"
         "called_from_lib:swrast_dri.so\n"
         "race:libLLVM\n"
         "race:libOSMesa.so\n"
         "called_from_lib:libOSMesa.so\n"
         "called_from_lib:libtbb.so\n"
         "race:libembree3.so\n"
         "called_from_lib:libembree3.so\n"
         "race:libopencv_aruco.so\n"
         "mutex:libopencv_imgproc.so\n"
         "race:libopenblas.so\n"
         "mutex:nptl_deallocate_tsd\n"
         "race:libaravis-0.8.so\n"
         "race:libglib-2.0.so\n"
         "race:libgio-2.0.so\n"
         "race:libgobject-2.0.so\n"
         "called_from_lib:libopencv_core.so\n";
}

extern "C" const char* __lsan_default_suppressions() {
  // OpenCV: buffers of its worker threads, below libtbb, whose frames a fast stack walk does not find.
  return "leak:libOSMesa.so\n"
         "leak:libopencv_core.so\n"
         "leak:libtbb.so\n";
}
