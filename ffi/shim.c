/* Batches of rays for Embree. Flush-to-zero and denormals-are-zero matter for traversal speed, are a property of
   the thread, and must not be changed under Rust code: so each call sets them and puts them back. */
#include "shim.h"

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

static const int ALL[8] __attribute__((aligned(32))) = {-1, -1, -1, -1, -1, -1, -1, -1};

static void fill_valid(int *valid, size_t lanes) {
    for (size_t lane = 0; lane < 8; ++lane) valid[lane] = lane < lanes ? -1 : 0;
}

void gdpt_closest(RTCScene scene, struct RTCRayHit8 *blocks, size_t count, int coherent) {
    float_mode before = enter_fast_mode();
    struct RTCIntersectArguments args;
    rtcInitIntersectArguments(&args);
    args.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
    args.feature_mask = RTC_FEATURE_FLAG_TRIANGLE;
    size_t full = count / 8;
    for (size_t block = 0; block < full; ++block) rtcIntersect8(ALL, scene, &blocks[block], &args);
    if (count % 8) {
        int valid[8] __attribute__((aligned(32)));
        fill_valid(valid, count % 8);
        rtcIntersect8(valid, scene, &blocks[full], &args);
    }
    leave_fast_mode(before);
}

void gdpt_any(RTCScene scene, struct RTCRay8 *blocks, size_t count, int coherent) {
    float_mode before = enter_fast_mode();
    struct RTCOccludedArguments args;
    rtcInitOccludedArguments(&args);
    args.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
    args.feature_mask = RTC_FEATURE_FLAG_TRIANGLE;
    size_t full = count / 8;
    for (size_t block = 0; block < full; ++block) rtcOccluded8(ALL, scene, &blocks[block], &args);
    if (count % 8) {
        int valid[8] __attribute__((aligned(32)));
        fill_valid(valid, count % 8);
        rtcOccluded8(valid, scene, &blocks[full], &args);
    }
    leave_fast_mode(before);
}
