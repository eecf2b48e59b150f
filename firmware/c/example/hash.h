/* FNV-1a over what the examples compute, and what they ask of each call. */
#ifndef HASH_H
#define HASH_H
#include "omnistep.h"

#define HASH_START 0x811c9dc5u

static inline uint32_t take_byte(uint32_t hash, uint8_t byte) { return (hash ^ byte) * 0x01000193u; }

/* Over the bits of a number. */
static inline uint32_t take(uint32_t hash, float value) {
    union {
        float number;
        uint8_t bytes[4];
    } bits = {.number = value};
    for (int i = 0; i < 4; i++) {
        hash = take_byte(hash, bits.bytes[i]);
    }
    return hash;
}

static inline uint32_t take_pose(uint32_t hash, const omni_pose *pose) {
    return take(take(take(hash, pose->x_m), pose->y_m), pose->yaw_rad);
}

static inline uint32_t take_twist(uint32_t hash, const omni_twist *twist) {
    return take(take(take(hash, twist->vx_m_s), twist->vy_m_s), twist->wz_rad_s);
}

static inline bool done(omni_status status) { return status == OMNI_STATUS_OK; }

static inline bool within(int k, int first, int end) { return k >= first && k < end; }
#endif
