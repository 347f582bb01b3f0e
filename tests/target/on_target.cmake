# Each program on the emulated board, its bits against the PC's; the budgets; what must fail.
set(host_programs ${PROJECT_SOURCE_DIR}/build/host/tests/target)
set(run ${CMAKE_CURRENT_SOURCE_DIR}/run_image.sh)
set(stack_check ${PROJECT_SOURCE_DIR}/toolchains/stack.py)

# The same filters and regressors compiled for size: a fixed-size matrix library links a heap there, and bits may not change.
add_library(target_filters_Os OBJECT ${filter_objects})
target_link_libraries(target_filters_Os PRIVATE target_rules)
target_program(bits_filters_Os bits/filters.cpp target_filters_Os)
target_program(bits_regressors_Os bits/regressors.cpp ${regressor_libraries_Os})
target_program(bits_estimator_Os bits/estimator.cpp)
foreach(name target_filters_Os ${regressor_libraries_Os} bits_filters_Os bits_regressors_Os bits_estimator_Os)
  target_compile_options(${name} PRIVATE -Os)
endforeach()

foreach(program ${bits} filters_Os regressors_Os estimator_Os)
  string(REPLACE _Os "" source ${program})
  set(input "")
  if(source MATCHES "estimator|preempted|extended")
    set(input --input ${host_programs}/trace.bin)
  endif()
  add_test(NAME bits_${program} COMMAND ${run} ${ARMCAL_BOARD} $<TARGET_FILE:bits_${program}> --same-as ${host_programs}/bits_${source} ${input})
  set_tests_properties(bits_${program} PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 300 LABELS target)
endforeach()

# With a board's own start-up instead of the runner's.
add_executable(cortex_m_bench cortex_m_main.cpp ${PROJECT_SOURCE_DIR}/port/mps2/startup.cpp ${PROJECT_SOURCE_DIR}/port/mps2/fault.cpp)
target_link_libraries(cortex_m_bench PRIVATE armcal_bench armcal_hardware)
target_include_directories(cortex_m_bench PRIVATE ${PROJECT_SOURCE_DIR})
target_link_options(cortex_m_bench PRIVATE -L${PROJECT_SOURCE_DIR}/port/mps2 -T ${ARMCAL_BOARD}.ld)

# The example firmware's three contexts; together with three exception frames they have 16 KB (sections.ld).
add_test(NAME Stack_OfEveryContextOfTheFirmware_IsBounded COMMAND_EXPAND_LISTS
  COMMAND ${stack_check} --limit 4096 --root "^void Application" --root "^void TickInterrupt" --root "^void SerialInterrupt"
          --indirect ${PROJECT_SOURCE_DIR}/port/mps2/application/indirect_calls.txt $<TARGET_OBJECTS:armcal_firmware>
          $<TARGET_OBJECTS:armcal_port_mps2> $<TARGET_OBJECTS:armcal_link> $<TARGET_OBJECTS:armcal_table>)

# The README's firmware, spoken to over its serial line.
add_test(NAME Firmware_OverItsSerialLine_TakesATableAndLearns
  COMMAND ${PROJECT_SOURCE_DIR}/tests/readme/firmware_session.py ${ARMCAL_BOARD} $<TARGET_FILE:armcal_firmware>
          ${PROJECT_SOURCE_DIR}/build/host/armcal)
set_tests_properties(Firmware_OverItsSerialLine_TakesATableAndLearns PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 300 LABELS target)

# The same firmware's storage, over the line: 200 round trips, and 50 power cuts during a save.
add_test(NAME Firmware_StoredTables_SurvivePowerCuts
  COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/stored_tables.py ${ARMCAL_BOARD} $<TARGET_FILE:armcal_firmware>)
set_tests_properties(Firmware_StoredTables_SurvivePowerCuts PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 3600 LABELS long)

# The same firmware on sectors that take two seconds to erase.
add_test(NAME Firmware_WhileASectorIsErased_LosesNoSample
  COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/slow_sectors.py ${ARMCAL_BOARD} $<TARGET_FILE:armcal_firmware_slow>)
set_tests_properties(Firmware_WhileASectorIsErased_LosesNoSample PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 300 LABELS target)

# The same firmware with its tick in RAM: while the flash is erased, nothing may read it.
if(ARMCAL_TICK_IN_RAM)
  set(ram_image --image $<TARGET_FILE:armcal_firmware_ram> --map ${PROJECT_BINARY_DIR}/port/mps2/armcal_firmware_ram.map --within 20000000-20400000)
  add_test(NAME Tick_InRam_ReachesNothingElsewhere COMMAND ${ARMCAL_REACH} ${ram_image})
  add_test(NAME Tick_InRam_GoesOnWhileTheFlashIsErased
    COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/tick_in_ram.py ${ARMCAL_BOARD} $<TARGET_FILE:armcal_firmware_ram>)
  set_tests_properties(Tick_InRam_ReachesNothingElsewhere PROPERTIES LABELS target)
  set_tests_properties(Tick_InRam_GoesOnWhileTheFlashIsErased PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 300 LABELS target)
endif()

# The public rules of Modbus, asked of the same firmware: a few of them, and all with the long tests.
set(rules ${PROJECT_SOURCE_DIR}/build/host/tests/e2e/test_e2e_modbus_rules)
foreach(part "Firmware_OverItsSerialLine_KeepsRulesOfModbus|*.AReply_*:*/Requests.ReadingRegisters/serial|target"
             "Firmware_OverItsSerialLine_KeepsAllRulesOfModbus|Serial.*:*/serial|long")
  string(REPLACE "|" ";" words ${part})
  list(GET words 0 name)
  list(GET words 1 filter)
  list(GET words 2 label)
  add_test(NAME ${name} COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/on_line.sh ${ARMCAL_BOARD} $<TARGET_FILE:armcal_firmware> ${rules} --gtest_filter=${filter})
  set_tests_properties(${name} PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 300 LABELS ${label})
endforeach()

# cmake --build --preset cortex-m4f --target budgets
set(core cortex-m4f)
if(ARMCAL_BOARD STREQUAL mps2-an500)
  set(core cortex-m7)
endif()
set(bench ${CMAKE_CURRENT_BINARY_DIR}/bench.txt)
set(objects "")
foreach(library target_filters ${regressor_libraries})
  string(APPEND objects "$<JOIN:$<TARGET_OBJECTS:${library}>,\n>\n")
endforeach()
file(GENERATE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/objects.txt CONTENT "${objects}")
string(REGEX REPLACE "nm$" "size" size_tool ${CMAKE_NM})
set(trace ${CMAKE_CURRENT_BINARY_DIR}/cycles_trace.txt)
set(names ${CMAKE_CURRENT_BINARY_DIR}/cycles_names.txt)
set(budgets ${PROJECT_SOURCE_DIR}/toolchains/budgets.py --core ${core} --budgets ${PROJECT_SOURCE_DIR}/toolchains/budgets.toml
            --size ${size_tool} --objects ${CMAKE_CURRENT_BINARY_DIR}/objects.txt
            --image $<TARGET_FILE:target_cycles> --trace ${trace} --names ${names} --objdump ${CMAKE_OBJDUMP})
add_custom_target(budgets VERBATIM
  COMMAND bash -c "\"$0\" \"$1\" \"$2\" >\"$3\"" ${run} ${ARMCAL_BOARD} $<TARGET_FILE:target_bench> ${bench}
  COMMAND bash -c "\"$0\" \"$1\" \"$2\" --trace \"$3\" >\"$4\"" ${run} ${ARMCAL_BOARD} $<TARGET_FILE:target_cycles> ${trace} ${names}
  COMMAND ${budgets} --bench ${bench} --json ${CMAKE_BINARY_DIR}/budgets.json
  DEPENDS target_bench target_cycles COMMENT "running the bench on ${ARMCAL_BOARD}")
add_test(NAME budgets COMMAND ${CMAKE_COMMAND} --build ${CMAKE_BINARY_DIR} --target budgets)
set_tests_properties(budgets PROPERTIES FIXTURES_SETUP bench LABELS target)
set_tests_properties(Stack_OfEveryContextOfTheFirmware_IsBounded PROPERTIES LABELS target)
add_test(NAME Cycles_OfSnippets_AreThoseCountedByHand COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/cycles_test.py)
set_tests_properties(Cycles_OfSnippets_AreThoseCountedByHand PROPERTIES LABELS target)

include(${CMAKE_CURRENT_SOURCE_DIR}/negative/tests.cmake)
