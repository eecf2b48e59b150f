// three.cpp on the bench of three_bench.c, which looks at what a drive tells in C.
#define every_period one_period
#include "three.cpp"
#undef every_period

extern "C" omni3_drive_output output;
omni3_drive_output output;

extern "C" void every_period() {
    one_period();
    const auto& told = base->drive.output();
    output.mode = static_cast<omni_drive_mode>(told.mode());
    output.status = static_cast<omni_command_status>(told.status());
    for (int i = 0; i < 3; i++) {
        output.references.rad_s[i] = told.references_rad_s()[i];
        output.torques.n_m[i] = told.torques_n_m()[i];
        output.active[i] = told.active()[i];
        output.brake[i] = told.brake()[i];
        output.faults[i] = static_cast<std::uint8_t>(told.faults()[i]);
    }
}
