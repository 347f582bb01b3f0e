# The reference, and the host's own share: other options of the PC's compiler must not change a bit either.
add_executable(make_trace make_trace.cpp)
target_link_libraries(make_trace PRIVATE armcal_host_rules armcal_plant armcal_codegen_robot)
set(trace ${CMAKE_CURRENT_BINARY_DIR}/trace.bin)
add_custom_command(OUTPUT ${trace} VERBATIM
  COMMAND make_trace ${PROJECT_SOURCE_DIR}/codegen/robots/er20_like.toml ${PROJECT_SOURCE_DIR}/host_sim/scenarios/stribeck.toml ${trace}
  DEPENDS make_trace ${PROJECT_SOURCE_DIR}/codegen/robots/er20_like.toml ${PROJECT_SOURCE_DIR}/host_sim/scenarios/stribeck.toml)
add_custom_target(target_trace ALL DEPENDS ${trace})
