# The PC's side: a recorded trace, each program once with the host's options and once with every instruction that this PC has. Another
# bit is a fault here already, before any target runs.
add_executable(make_trace make_trace.cpp)
target_link_libraries(make_trace PRIVATE armcal_host_rules armcal_plant armcal_codegen_robot)
set(trace ${CMAKE_CURRENT_BINARY_DIR}/trace.bin)
set(robot ${PROJECT_SOURCE_DIR}/codegen/robots/er20_like.toml)
set(scenario ${PROJECT_SOURCE_DIR}/host_sim/scenarios/stribeck.toml)
add_custom_command(OUTPUT ${trace} VERBATIM COMMAND make_trace ${robot} ${scenario} ${trace} DEPENDS make_trace ${robot} ${scenario})
add_custom_target(target_trace ALL DEPENDS ${trace})

add_library(target_filters_native OBJECT ${filter_objects})
target_link_libraries(target_filters_native PRIVATE target_rules)
target_program(bits_elementary_native bits/elementary.cpp)
target_program(bits_kernels_native bits/kernels.cpp)
target_program(bits_signal_native bits/signal.cpp)
target_program(bits_filters_native bits/filters.cpp target_filters_native)
target_program(bits_estimator_native bits/estimator.cpp)
foreach(program elementary kernels signal filters estimator)
  target_compile_options(bits_${program}_native PRIVATE -march=native)
  add_test(NAME bits_${program}_native
           COMMAND bash -c "set -e; \"$0\" \"$2\" >${program}.txt; \"$1\" \"$2\" >${program}_native.txt; cmp ${program}.txt ${program}_native.txt"
           $<TARGET_FILE:bits_${program}> $<TARGET_FILE:bits_${program}_native> ${trace})
  set_tests_properties(bits_${program}_native PROPERTIES LABELS fast)
endforeach()
target_compile_options(target_filters_native PRIVATE -march=native)

# Under sanitizers: the code of the filters without the matrices of their unit tests, which take minutes to compile so.
if(ARMCAL_SANITIZE)
  foreach(program elementary kernels filters)
    add_test(NAME sanitized_${program} COMMAND bits_${program})
    set_tests_properties(sanitized_${program} PROPERTIES LABELS fast)
  endforeach()
endif()
