# find_package(ravenpose) gives ravenpose::bridge (shared) and ravenpose::bridge_static.
get_filename_component(_ravenpose_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
foreach(_file include/ravenpose.h lib/libravenpose_bridge.so lib/libravenpose_bridge.a)
  if(NOT EXISTS "${_ravenpose_prefix}/${_file}")
    set(ravenpose_FOUND FALSE)
    set(ravenpose_NOT_FOUND_MESSAGE "${_ravenpose_prefix}/${_file} is missing; run make install PREFIX=${_ravenpose_prefix}")
    return()
  endif()
endforeach()
if(NOT TARGET ravenpose::bridge)
  add_library(ravenpose::bridge SHARED IMPORTED)
  set_target_properties(ravenpose::bridge PROPERTIES
    IMPORTED_LOCATION "${_ravenpose_prefix}/lib/libravenpose_bridge.so"
    IMPORTED_SONAME "libravenpose_bridge.so.1"
    INTERFACE_INCLUDE_DIRECTORIES "${_ravenpose_prefix}/include")
  add_library(ravenpose::bridge_static STATIC IMPORTED)
  set_target_properties(ravenpose::bridge_static PROPERTIES
    IMPORTED_LOCATION "${_ravenpose_prefix}/lib/libravenpose_bridge.a"
    INTERFACE_LINK_LIBRARIES "pthread;dl;m;rt"
    INTERFACE_INCLUDE_DIRECTORIES "${_ravenpose_prefix}/include")
endif()
