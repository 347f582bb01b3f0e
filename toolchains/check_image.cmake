# What a firmware image must not contain, and how large it may be. Called after the link:
#   cmake -DIMAGE=a.elf -DNM=arm-none-eabi-nm "-DOBJECTS=folder;folder" -P check_image.cmake
set(largest_frame_bytes 2048)  # of one function; 16 KB of stack serve background, tick and serial interrupt together

execute_process(COMMAND ${NM} ${IMAGE} OUTPUT_VARIABLE symbols RESULT_VARIABLE failed)
if(failed)
  message(FATAL_ERROR "${IMAGE}: no symbols to look at")
endif()
set(found "")
foreach(rule
    "double arithmetic:__aeabi_(d[a-z0-9]+|f2d|i2d|ui2d|l2d|ul2d)"
    "heap:(malloc|calloc|realloc|free|_malloc_r|_free_r|_sbrk|_sbrk_r|_Zn[wa][a-zA-Z0-9]*|_Zd[la][a-zA-Z0-9]*)"
    "exceptions:(__cxa_[a-z_]+|__gxx_personality[a-z_0-9]*|_Unwind_[a-zA-Z]+)"
    "mathematical library:(sin|cos|sincos|exp|log|tanh|cbrt|pow|sqrt|fmod)f?"
    "stream or formatted output:(printf|_printf_r|vfprintf|_vfprintf_r|puts|_puts_r)")
  string(REGEX MATCH "^[^:]+" what "${rule}")
  string(REGEX REPLACE "^[^:]+:" "" pattern "${rule}")
  string(REGEX MATCHALL " [A-Za-z] ${pattern}\n" hits "${symbols}")
  foreach(hit ${hits})
    string(STRIP "${hit}" hit)
    string(APPEND found "\n  ${what}: ${hit}")
  endforeach()
endforeach()

# Stack: every frame bounded and small. (-fstack-usage writes "file:line:column:function<tab>bytes<tab>kind".)
list(TRANSFORM OBJECTS APPEND /*.su)
file(GLOB_RECURSE usages ${OBJECTS})
set(largest 0)
foreach(usage ${usages})
  file(STRINGS ${usage} lines)
  foreach(line ${lines})
    if(line MATCHES "\t([0-9]+)\t([a-z,]+)$")
      set(bytes ${CMAKE_MATCH_1})
      set(kind ${CMAKE_MATCH_2})
      if(kind STREQUAL "dynamic" OR bytes GREATER largest_frame_bytes)
        string(APPEND found "\n  stack frame (${kind}): ${line}")
      endif()
      if(bytes GREATER largest)
        set(largest ${bytes})
      endif()
    endif()
  endforeach()
endforeach()

if(found)
  file(REMOVE ${IMAGE})
  message(FATAL_ERROR "${IMAGE} contains what a controller must not:${found}")
endif()
string(REGEX REPLACE "nm$" "size" size_tool ${NM})
execute_process(COMMAND ${size_tool} ${IMAGE} OUTPUT_VARIABLE size)
message("${size}largest stack frame ${largest} bytes")
