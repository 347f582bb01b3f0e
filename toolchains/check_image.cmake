# What a firmware image must not contain, and how large it may be. Called after the link:
#   cmake -DIMAGE=a.elf -DNM=arm-none-eabi-nm "-DOBJECTS=folder;folder" -P check_image.cmake
set(largest_data_bytes 256)  # of one object in .data, which takes flash and RAM; a filter belongs in .bss
set(largest_frame_bytes 2048)  # of one function; 16 KB of stack serve background, tick and serial interrupt together

execute_process(COMMAND ${NM} -S ${IMAGE} OUTPUT_VARIABLE symbols RESULT_VARIABLE failed)
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

string(REGEX MATCHALL "[0-9a-f]+ [dD] [^\n]+\n" objects "${symbols}")
foreach(object ${objects})
  string(REGEX MATCH "^[0-9a-f]+" bytes "${object}")
  math(EXPR bytes "0x${bytes}")
  if(object MATCHES " [dD] (data_begin|data_end)\n" OR bytes LESS_EQUAL largest_data_bytes)
    continue()
  endif()
  string(STRIP "${object}" object)
  string(APPEND found "\n  ${bytes} bytes of initialised data: ${object}")
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
