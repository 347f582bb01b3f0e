# What must fail, one for each proof: a proof that cannot fail proves nothing.
# must_fail(NAME REASON COMMAND...): passes if the command says why it failed.
function(must_fail name reason)
  add_test(NAME ${name} COMMAND ${ARGN} COMMAND_EXPAND_LISTS)
  set_tests_properties(${name} PROPERTIES PASS_REGULAR_EXPRESSION "${reason}" SKIP_RETURN_CODE 77 LABELS target)
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

negative_program(data)
must_fail(Image_WithAFilterInData_FailsTheCheck "260 bytes of initialised data: [0-9a-f]+ d .*numbers"
  bash -c "cp \"$1\" data.elf && \"$0\" -DIMAGE=data.elf -DNM=\"$2\" -DOBJECTS=nowhere -P \"$3\"" ${CMAKE_COMMAND}
  $<TARGET_FILE:negative_data> ${CMAKE_NM} ${PROJECT_SOURCE_DIR}/toolchains/check_image.cmake)

if(core STREQUAL cortex-m4f)  # a Cortex-M7 computes doubles without a library; the sources are the same
  negative_program(double)
  must_fail(Image_WithADouble_FailsTheCheck "double arithmetic: .*__aeabi_dmul"
    bash -c "cp \"$1\" double.elf && \"$0\" -DIMAGE=double.elf -DNM=\"$2\" -DOBJECTS=nowhere -P \"$3\"" ${CMAKE_COMMAND}
    $<TARGET_FILE:negative_double> ${CMAKE_NM} ${PROJECT_SOURCE_DIR}/toolchains/check_image.cmake)

  # With the compiler's own flags no table is adopted: Contracted.
  add_executable(negative_default_flags negative/default_flags.cpp $<TARGET_OBJECTS:armcal_runner>)
  target_include_directories(negative_default_flags PRIVATE ${PROJECT_SOURCE_DIR} ${PROJECT_SOURCE_DIR}/lib)
  target_link_options(negative_default_flags PRIVATE -L${PROJECT_SOURCE_DIR}/port/mps2 -T ${ARMCAL_BOARD}.ld)
  set_target_properties(negative_default_flags PROPERTIES CXX_STANDARD 17 CXX_EXTENSIONS ON)
  must_fail(Firmware_WithDefaultFlags_AdoptsNoTable "table 24" ${run} ${ARMCAL_BOARD} $<TARGET_FILE:negative_default_flags>)
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

# One function of the tick stays in flash.
if(ARMCAL_TICK_IN_RAM)
  must_fail(Tick_WithAFunctionLeftInFlash_IsNamed "not in 20000000-20400000: [0-9a-f]+ float armcal::model::RowTorque"
    ${ARMCAL_REACH} --image $<TARGET_FILE:negative_tick_in_flash> --map ${PROJECT_BINARY_DIR}/port/mps2/negative_tick_in_flash.map
    --within 20000000-20400000)
  must_fail(Tick_WithAFunctionLeftInFlash_EndsWithAFault "silent after a fault: Prefetch Abort"
    ${CMAKE_CURRENT_SOURCE_DIR}/tick_in_ram.py ${ARMCAL_BOARD} $<TARGET_FILE:negative_tick_in_flash>)
  must_fail(Tick_CallThroughAPointerThatNobodyListed_IsFound "call through a pointer: TickInterrupt" ${ARMCAL_REACH} ${ram_image} --pointers /dev/null)
endif()

# budgets.py has to see a count that depends on data, a figure that rose, and a loop that takes too many cycles.
must_fail(Budgets_FiguresThatAreWrong_AreNamed
  "forgetting_60: instructions depend on the data.*forgetting_60: solve 1[0-9]+, was [0-9]+ .\\+.*FoldBlock_1_4_6: [0-9.]+ modelled cycles an instruction, limit 0.5"
  bash -c "sed -e '/forgetting n 60/s/instructions_least [0-9]*/instructions_least 1/' -e '/forgetting n 60/s/ solve / solve 1/' \"$0\" >wrong.txt && \
           sed 's/^cycles_per_instruction = .*/cycles_per_instruction = { cortex-m4f = 0.5, cortex-m7 = 0.5 }/' \"$1\" >tight.toml && \
           \"\${@:2}\" --json wrong.json --bench wrong.txt --budgets tight.toml"
  ${bench} ${PROJECT_SOURCE_DIR}/toolchains/budgets.toml ${budgets})
set_tests_properties(Budgets_FiguresThatAreWrong_AreNamed PROPERTIES FIXTURES_REQUIRED bench)
