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
  if(source MATCHES "estimator|preempted")
    set(input --input ${host_programs}/trace.bin)
  endif()
  add_test(NAME bits_${program} COMMAND ${run} ${ARMCAL_BOARD} $<TARGET_FILE:bits_${program}> --same-as ${host_programs}/bits_${source} ${input})
  set_tests_properties(bits_${program} PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 300)
endforeach()

# With a board's own start-up instead of the runner's.
add_executable(cortex_m_bench cortex_m_main.cpp ${PROJECT_SOURCE_DIR}/port/mps2/startup.cpp ${PROJECT_SOURCE_DIR}/port/mps2/fault.cpp)
target_link_libraries(cortex_m_bench PRIVATE armcal_bench armcal_port)
target_include_directories(cortex_m_bench PRIVATE ${PROJECT_SOURCE_DIR})
target_link_options(cortex_m_bench PRIVATE -L${PROJECT_SOURCE_DIR}/port/mps2 -T ${ARMCAL_BOARD}.ld)

# The example firmware's three contexts; together with three exception frames they have 16 KB (sections.ld).
add_test(NAME Stack_OfEveryContextOfTheFirmware_IsBounded COMMAND_EXPAND_LISTS
  COMMAND ${stack_check} --limit 4096 --root "^void Application" --root "^void TickInterrupt" --root "^void SerialInterrupt"
          --indirect ${PROJECT_SOURCE_DIR}/port/mps2/application/indirect_calls.txt $<TARGET_OBJECTS:armcal_image>
          $<TARGET_OBJECTS:armcal_port_mps2> $<TARGET_OBJECTS:armcal_link> $<TARGET_OBJECTS:armcal_table>)

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
set(budgets ${PROJECT_SOURCE_DIR}/toolchains/budgets.py --core ${core} --budgets ${PROJECT_SOURCE_DIR}/toolchains/budgets.toml
            --size ${size_tool} --objects ${CMAKE_CURRENT_BINARY_DIR}/objects.txt)
add_custom_target(budgets VERBATIM
  COMMAND bash -c "\"$0\" \"$1\" \"$2\" >\"$3\"" ${run} ${ARMCAL_BOARD} $<TARGET_FILE:target_bench> ${bench}
  COMMAND ${budgets} --bench ${bench} --json ${CMAKE_BINARY_DIR}/budgets.json
  DEPENDS target_bench)
add_test(NAME budgets COMMAND ${CMAKE_COMMAND} --build ${CMAKE_BINARY_DIR} --target budgets)
set_tests_properties(budgets PROPERTIES FIXTURES_SETUP bench)

# must_fail(NAME REASON COMMAND...): passes if the command says why it failed.
function(must_fail name reason)
  add_test(NAME ${name} COMMAND ${ARGN} COMMAND_EXPAND_LISTS)
  set_tests_properties(${name} PROPERTIES PASS_REGULAR_EXPRESSION "${reason}")
endfunction()
# An image as target_program makes it, but nobody checks it after the link.
function(negative_program name)
  add_executable(negative_${name} negative/${name}.cpp)
  target_link_libraries(negative_${name} PRIVATE armcal_rules armcal_runner)
endfunction()

add_library(negative_malloc OBJECT negative/malloc.cpp)
target_link_libraries(negative_malloc PRIVATE armcal_rules)
target_include_directories(negative_malloc PRIVATE ${PROJECT_SOURCE_DIR})
separate_arguments(link_flags NATIVE_COMMAND "${CMAKE_EXE_LINKER_FLAGS}")
must_fail(Image_ThatTakesMemory_DoesNotLink "malloc is linked in"
  ${CMAKE_CXX_COMPILER} ${link_flags} -L${PROJECT_SOURCE_DIR}/port/mps2 -T ${ARMCAL_BOARD}.ld -o malloc.elf
  $<TARGET_OBJECTS:negative_malloc> $<TARGET_OBJECTS:armcal_runner>)

negative_program(fpu_off)
must_fail(Image_WithTheFpuOff_EndsWithNoCoprocessor "fault: CFSR 00080000\n.*ends with 99"
  bash -c "\"$0\" \"$1\" \"$2\" || echo ends with $?" ${run} ${ARMCAL_BOARD} $<TARGET_FILE:negative_fpu_off>)

if(core STREQUAL cortex-m4f)  # a Cortex-M7 computes doubles without a library; the sources are the same
  negative_program(double)
  must_fail(Image_WithADouble_FailsTheCheck "double arithmetic: .*__aeabi_dmul"
    bash -c "cp \"$1\" double.elf && \"$0\" -DIMAGE=double.elf -DNM=\"$2\" -DOBJECTS=nowhere -P \"$3\"" ${CMAKE_COMMAND}
    $<TARGET_FILE:negative_double> ${CMAKE_NM} ${PROJECT_SOURCE_DIR}/toolchains/check_image.cmake)
endif()

# Contraction is what would make target and PC differ first: the comparison has to see it.
negative_program(contracted)
target_link_libraries(negative_contracted PRIVATE target_rules)
set_source_files_properties(negative/contracted.cpp PROPERTIES COMPILE_OPTIONS -ffp-contract=fast)  # the last word
must_fail(Image_WithContraction_HasOtherBits "differ from the target's"
  ${run} ${ARMCAL_BOARD} $<TARGET_FILE:negative_contracted> --same-as ${host_programs}/bits_kernels)

add_library(negative_unbounded OBJECT negative/unbounded.cpp)
target_link_libraries(negative_unbounded PRIVATE armcal_rules)
set(unbounded $<TARGET_OBJECTS:negative_unbounded>)
foreach(proof "Recursion:Odd:recursion. .*Odd.*Even.*Odd" "DataSizedFrame:DataSized:dynamic frame" "CallThroughAPointer:ThroughPointer:call through a pointer"
              "FrameBeyondTheLimit:Deep:more than 512")
  string(REPLACE ":" ";" proof ${proof})
  list(GET proof 0 name)
  list(GET proof 1 root)
  list(GET proof 2 reason)
  must_fail(Stack_${name}_IsFound "${reason}"
    ${stack_check} --limit 512 --root " ${root}\\(" ${unbounded})
endforeach()

# budgets.py has to see a figure that depends on data, and one that rose by more than it may.
must_fail(Budgets_CountThatDependsOnData_IsFound "forgetting_60: instructions depend on the data"
  bash -c "sed '/forgetting n 60/s/instructions_least [0-9]*/instructions_least 1/' \"$0\" >varying.txt && \"$@\" --json varying.json --bench varying.txt"
  ${bench} ${budgets})
must_fail(Budgets_RiseOfThreePercent_IsNamed "forgetting_60: solve [0-9]*, was [0-9]* .*3.0 %"
  bash -c "awk '/forgetting n 60/ { for (k = 1; k < NF; ++k) if ($k ~ /^solve/) $(k + 1) = int($(k + 1) * 1.03 + 0.5) } 1' \"$0\" >risen.txt && \"$@\" --json risen.json --bench risen.txt"
  ${bench} ${budgets})
set_tests_properties(Budgets_CountThatDependsOnData_IsFound Budgets_RiseOfThreePercent_IsNamed PROPERTIES FIXTURES_REQUIRED bench)
