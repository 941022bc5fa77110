/* Batches of rays for Embree. Flush-to-zero and denormals-are-zero matter for traversal speed, are a property of
   the thread, and must not be changed under Rust code: so each call sets them and puts them back. */
#include "shim.h"

#include <string.h>

#if defined(__SSE__) || defined(__x86_64__)
#include <xmmintrin.h>
typedef unsigned int float_mode;
static float_mode enter_fast_mode(void) {
    float_mode before = _mm_getcsr();
    _mm_setcsr(before | 0x8040u); /* FTZ | DAZ */
    return before;
}
static void leave_fast_mode(float_mode before) { _mm_setcsr(before); }
#else
typedef int float_mode;
static float_mode enter_fast_mode(void) { return 0; }
static void leave_fast_mode(float_mode before) { (void)before; }
#endif

_Static_assert(sizeof(struct RTCRay8) == 384, "RTCRay8 has another layout than the Rust side expects");
_Static_assert(sizeof(struct RTCRayHit8) == 672, "RTCRayHit8 has another layout: Embree 4.3 or later is needed");

/* Packets are structures of arrays of 4-byte values, `lanes` to an array: a block of 8 and a packet of another
   width differ in the length of the arrays alone. */
enum { RAY_FIELDS = sizeof(struct RTCRay8) / 32, HIT_FIELDS = sizeof(struct RTCRayHit8) / 32 };
_Static_assert(sizeof(struct RTCRayHit4) == HIT_FIELDS * 16, "RTCRayHit4 is not like RTCRayHit8");
_Static_assert(sizeof(struct RTCRayHit16) == HIT_FIELDS * 64, "RTCRayHit16 is not like RTCRayHit8");
_Static_assert(sizeof(struct RTCRay4) == RAY_FIELDS * 16, "RTCRay4 is not like RTCRay8");
_Static_assert(sizeof(struct RTCRay16) == RAY_FIELDS * 64, "RTCRay16 is not like RTCRay8");

_Static_assert(offsetof(struct RTCHit8, u) == 3 * 32 && offsetof(struct RTCHit8, v) == 4 * 32 &&
                   offsetof(struct RTCHit8, primID) == 5 * 32,
               "RTCHitN has another layout");

static const int ALL[16] __attribute__((aligned(64))) = {-1, -1, -1, -1, -1, -1, -1, -1,
                                                         -1, -1, -1, -1, -1, -1, -1, -1};

static size_t least(size_t a, size_t b) { return a < b ? a : b; }

static void fill_valid(int *valid, size_t width, size_t lanes) {
    for (size_t lane = 0; lane < width; ++lane) valid[lane] = lane < lanes ? -1 : 0;
}

/* Copies 4 lanes from `first` of a block of 8 to a packet of 4, or back. */
static void half_block(void *packet, void *block, size_t first, int fields, int back) {
    for (int f = 0; f < fields; ++f) {
        char *p = (char *)packet + f * 16, *b = (char *)block + f * 32 + first * 4;
        memcpy(back ? b : p, back ? p : b, 16);
    }
}

/* Copies a block of 8 to lanes from `first` of a packet of 16, or back. */
static void two_blocks(void *packet, void *block, size_t first, int fields, int back) {
    for (int f = 0; f < fields; ++f) {
        char *p = (char *)packet + f * 64 + first * 4, *b = (char *)block + f * 32;
        memcpy(back ? b : p, back ? p : b, 32);
    }
}

static float *field(void *block, int f) { return (float *)((char *)block + f * 32); }

/* What the batches may meet. */
static const enum RTCFeatureFlags FEATURES =
    RTC_FEATURE_FLAG_TRIANGLE | RTC_FEATURE_FLAG_FILTER_FUNCTION_IN_GEOMETRY;

void gdpt_closest(RTCScene scene, struct RTCRayHit8 *blocks, size_t count, enum GdptWidth width, int coherent) {
    float_mode before = enter_fast_mode();
    struct RTCIntersectArguments args;
    rtcInitIntersectArguments(&args);
    args.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
    args.feature_mask = FEATURES;
    int valid[16] __attribute__((aligned(64)));
    switch (width) {
    case GDPT_SINGLE:
        for (size_t i = 0; i < count; ++i) {
            struct RTCRayHit one __attribute__((aligned(16)));
            struct RTCRayHit8 *block = &blocks[i / 8];
            for (int f = 0; f < HIT_FIELDS; ++f) ((float *)&one)[f] = field(block, f)[i % 8];
            rtcIntersect1(scene, &one, &args);
            if (one.hit.geomID == RTC_INVALID_GEOMETRY_ID) continue;
            block->ray.tfar[i % 8] = one.ray.tfar;
            block->hit.u[i % 8] = one.hit.u;
            block->hit.v[i % 8] = one.hit.v;
            block->hit.primID[i % 8] = one.hit.primID;
            block->hit.geomID[i % 8] = one.hit.geomID;
        }
        break;
    case GDPT_PACKET4:
        for (size_t i = 0; i < count; i += 4) {
            struct RTCRayHit4 packet;
            half_block(&packet, &blocks[i / 8], i % 8, HIT_FIELDS, 0);
            fill_valid(valid, 4, least(count - i, 4));
            rtcIntersect4(valid, scene, &packet, &args);
            half_block(&packet, &blocks[i / 8], i % 8, HIT_FIELDS, 1);
        }
        break;
    case GDPT_PACKET8:
        for (size_t i = 0; i < count; i += 8) {
            int full = count - i >= 8;
            if (!full) fill_valid(valid, 8, count - i);
            rtcIntersect8(full ? ALL : valid, scene, &blocks[i / 8], &args);
        }
        break;
    case GDPT_PACKET16:
        for (size_t i = 0; i < count; i += 16) {
            struct RTCRayHit16 packet;
            int second = count - i > 8;
            two_blocks(&packet, &blocks[i / 8], 0, HIT_FIELDS, 0);
            if (second) two_blocks(&packet, &blocks[i / 8 + 1], 8, HIT_FIELDS, 0);
            fill_valid(valid, 16, least(count - i, 16));
            rtcIntersect16(valid, scene, &packet, &args);
            two_blocks(&packet, &blocks[i / 8], 0, HIT_FIELDS, 1);
            if (second) two_blocks(&packet, &blocks[i / 8 + 1], 8, HIT_FIELDS, 1);
        }
        break;
    }
    leave_fast_mode(before);
}

void gdpt_any(RTCScene scene, struct RTCRay8 *blocks, size_t count, enum GdptWidth width, int coherent) {
    float_mode before = enter_fast_mode();
    struct RTCOccludedArguments args;
    rtcInitOccludedArguments(&args);
    args.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
    args.feature_mask = FEATURES;
    int valid[16] __attribute__((aligned(64)));
    switch (width) {
    case GDPT_SINGLE:
        for (size_t i = 0; i < count; ++i) {
            struct RTCRay one __attribute__((aligned(16)));
            struct RTCRay8 *block = &blocks[i / 8];
            for (int f = 0; f < RAY_FIELDS; ++f) ((float *)&one)[f] = field(block, f)[i % 8];
            rtcOccluded1(scene, &one, &args);
            block->tfar[i % 8] = one.tfar;
        }
        break;
    case GDPT_PACKET4:
        for (size_t i = 0; i < count; i += 4) {
            struct RTCRay4 packet;
            half_block(&packet, &blocks[i / 8], i % 8, RAY_FIELDS, 0);
            fill_valid(valid, 4, least(count - i, 4));
            rtcOccluded4(valid, scene, &packet, &args);
            half_block(&packet, &blocks[i / 8], i % 8, RAY_FIELDS, 1);
        }
        break;
    case GDPT_PACKET8:
        for (size_t i = 0; i < count; i += 8) {
            int full = count - i >= 8;
            if (!full) fill_valid(valid, 8, count - i);
            rtcOccluded8(full ? ALL : valid, scene, &blocks[i / 8], &args);
        }
        break;
    case GDPT_PACKET16:
        for (size_t i = 0; i < count; i += 16) {
            struct RTCRay16 packet;
            int second = count - i > 8;
            two_blocks(&packet, &blocks[i / 8], 0, RAY_FIELDS, 0);
            if (second) two_blocks(&packet, &blocks[i / 8 + 1], 8, RAY_FIELDS, 0);
            fill_valid(valid, 16, least(count - i, 16));
            rtcOccluded16(valid, scene, &packet, &args);
            two_blocks(&packet, &blocks[i / 8], 0, RAY_FIELDS, 1);
            if (second) two_blocks(&packet, &blocks[i / 8 + 1], 8, RAY_FIELDS, 1);
        }
        break;
    }
    leave_fast_mode(before);
}

void gdpt_bare_closest(RTCScene scene, struct RTCRayHit8 *blocks, size_t count) {
    float_mode before = enter_fast_mode();
    struct RTCIntersectArguments args;
    rtcInitIntersectArguments(&args);
    args.feature_mask = RTC_FEATURE_FLAG_TRIANGLE;
    for (size_t i = 0; i + 8 <= count; i += 8) rtcIntersect8(ALL, scene, &blocks[i / 8], &args);
    leave_fast_mode(before);
}

void gdpt_bare_any(RTCScene scene, struct RTCRay8 *blocks, size_t count) {
    float_mode before = enter_fast_mode();
    struct RTCOccludedArguments args;
    rtcInitOccludedArguments(&args);
    args.feature_mask = RTC_FEATURE_FLAG_TRIANGLE;
    for (size_t i = 0; i + 8 <= count; i += 8) rtcOccluded8(ALL, scene, &blocks[i / 8], &args);
    leave_fast_mode(before);
}

/* Embree asks this for every hit on a geometry with holes. The question goes to Rust, in Rust's own
   floating-point mode. */
static void keep_closed(const struct RTCFilterFunctionNArguments *args) {
    const struct GdptCutouts *cutouts = args->geometryUserPtr;
    float_mode fast = enter_fast_mode();
    leave_fast_mode(cutouts->mode);
    for (unsigned i = 0; i < args->N; ++i) {
        if (args->valid[i] != -1) continue;
        /* Arrays of N values, as Embree's accessors have them, which are there in C++ alone. */
        const float *hit = (const float *)args->hit;
        float u = hit[3 * args->N + i], v = hit[4 * args->N + i];
        unsigned triangle = cutouts->first + ((const unsigned *)args->hit)[5 * args->N + i];
        if (cutouts->is_open(cutouts->mesh, triangle, u, v)) args->valid[i] = 0;
    }
    leave_fast_mode(fast);
}

unsigned gdpt_float_mode(void) {
    float_mode mode = enter_fast_mode();
    leave_fast_mode(mode);
    return mode;
}

void gdpt_cut_out(RTCGeometry geometry, const struct GdptCutouts *cutouts) {
    rtcSetGeometryUserData(geometry, (void *)cutouts);
    rtcSetGeometryIntersectFilterFunction(geometry, keep_closed);
    rtcSetGeometryOccludedFilterFunction(geometry, keep_closed);
}

static bool add_bytes(void *sum, ssize_t bytes, bool after) {
    (void)after;
    __atomic_fetch_add((ptrdiff_t *)sum, bytes, __ATOMIC_RELAXED);
    return true;
}

void gdpt_count_memory(RTCDevice device, ptrdiff_t *bytes) {
    rtcSetDeviceMemoryMonitorFunction(device, add_bytes, bytes);
}
