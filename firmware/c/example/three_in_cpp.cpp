// three.cpp on the bench of three_bench.c, which looks at what a drive reports in C.
#define every_period one_period
#include "three.cpp"
#undef every_period

extern "C" omni3_drive_output output;
omni3_drive_output output;

extern "C" void every_period() {
    one_period();
    const auto& reported = base->drive.output();
    output.mode = static_cast<omni_drive_mode>(reported.mode());
    output.status = static_cast<omni_command_status>(reported.status());
    for (int i = 0; i < 3; i++) {
        output.references.rad_s[i] = reported.references_rad_s()[i];
        output.torques.n_m[i] = reported.torques_n_m()[i];
        output.active[i] = reported.active()[i];
        output.brake[i] = reported.brake()[i];
        output.faults[i] = static_cast<omni_fault>(reported.faults()[i]);
    }
}
