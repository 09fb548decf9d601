// SPDX-License-Identifier: MIT
#include "io/xml_array.h"

#include <stdlib.h>
#include <string.h>
#ifdef PLIANT_WITH_LATTICES // which brings zlib
#include <zlib.h>
#endif

static bool fail(const XmlCoding *coding, const XmlArray *array, Status *status, const char *what,
                 const char *says)
{
    return status_fail(status, STATUS_INVALID, "%s:%d: %s: %s", coding->path, array->content.line,
                       what, says);
}

// --- bytes -------------------------------------------------------------------------------------

// Bytes of the file, decoded from base64 as they are needed. Writers end a run of base64 where a
// header ends, or not: each four characters say for themselves how many bytes they are.
typedef struct Stream {
    const char *at, *end;
    bool base64;
    unsigned char left[3]; // bytes of the last four characters that were not taken yet
    int left_count;
} Stream;

static int base64_digit(char c)
{
    return c >= 'A' && c <= 'Z'   ? c - 'A'
           : c >= 'a' && c <= 'z' ? c - 'a' + 26
           : c >= '0' && c <= '9' ? c - '0' + 52
           : c == '+'             ? 62
           : c == '/'             ? 63
                                  : -1;
}

// Decodes the next four characters.
static bool decode_four(Stream *stream)
{
    unsigned bits = 0;
    int digits = 0, pads = 0;
    while (digits + pads < 4) {
        if (stream->at == stream->end)
            return false;
        const char c = *stream->at++;
        const int digit = base64_digit(c);
        if (c == ' ' || c == '\n' || c == '\r' || c == '\t')
            continue;
        if (c == '=' ? digits < 2 : digit < 0 || pads > 0)
            return false;
        digits += c != '=';
        pads += c == '=';
        bits = bits << 6 | (c == '=' ? 0U : (unsigned)digit);
    }
    stream->left_count = 3 - pads;
    for (int i = 0; i < 3; i++)
        stream->left[i] = (unsigned char)(bits >> (16 - 8 * i));
    return true;
}

static bool take(Stream *stream, void *to, size_t size)
{
    unsigned char *out = to;
    if (!stream->base64) {
        if ((size_t)(stream->end - stream->at) < size)
            return false;
        memcpy(to, stream->at, size);
        stream->at += size;
        return true;
    }
    for (; size > 0; size--) {
        if (stream->left_count == 0 && !decode_four(stream))
            return false;
        *out++ = stream->left[0];
        stream->left[0] = stream->left[1];
        stream->left[1] = stream->left[2];
        stream->left_count--;
    }
    return true;
}

// True if so many bytes may follow.
static bool may_follow(const Stream *stream, double size)
{
    const double left = (double)(stream->end - stream->at);
    return size <= (stream->base64 ? 0.75 * left + 3.0 : left);
}

static bool take_length(Stream *stream, const XmlCoding *coding, double *length)
{
    char bytes[8];
    if (!take(stream, bytes, (size_t)coding->word))
        return false;
    *length = number_decode(bytes, (NumberType){.size = coding->word}, coding->big_endian);
    return true;
}

static bool find_stream(const XmlCoding *coding, const XmlArray *array, Stream *stream)
{
    if (!array->appended) {
        *stream = (Stream){.at = array->content.at, .end = array->content.end, .base64 = true};
        return true;
    }
    *stream = (Stream){.at = coding->appended, .end = coding->end};
    stream->base64 = coding->appended_base64;
    if (stream->at == NULL || !(array->offset <= (double)(coding->end - coding->appended)))
        return false;
    stream->at += (size_t)array->offset;
    return true;
}

// --- blocks of zlib ----------------------------------------------------------------------------

#ifdef PLIANT_WITH_LATTICES

// No byte of deflate gives more than so many.
static const double DEFLATE_MOST = 1032.0;

static bool unpack_block(Stream *stream, size_t packed, char *to, size_t size)
{
    uLongf got = (uLongf)size;
    const char *from = stream->at;
    char *own = NULL;
    if (!may_follow(stream, (double)packed))
        return false;
    if (stream->base64) {
        own = malloc(packed + 1);
        if (own == NULL || !take(stream, own, packed)) {
            free(own);
            return false;
        }
        from = own;
    } else
        stream->at += packed;
    const int code = uncompress((Bytef *)to, &got, (const Bytef *)from, (uLong)packed);
    free(own);
    return code == Z_OK && got == size;
}

// Unpacks all blocks, whose sizes stand in front of them; NULL unless they are as announced.
static const char *unpack(const XmlCoding *coding, Stream *stream, double size, char **bytes)
{
    double blocks, block, last, packed, at = 0.0;
    if (!take_length(stream, coding, &blocks) || !take_length(stream, coding, &block) ||
        !take_length(stream, coding, &last) || !may_follow(stream, blocks * coding->word))
        return "its blocks are more than the file holds";
    if (blocks == 0.0 ? size != 0.0 : (blocks - 1.0) * block + (last > 0.0 ? last : block) != size)
        return "its blocks are not as long as its numbers";
    if (!may_follow(stream, size / DEFLATE_MOST))
        return "it is longer than its blocks can be";
    Stream sizes = *stream;
    for (double i = 0.0; i < blocks; i++)
        if (!take_length(stream, coding, &packed))
            return "the file ends inside it";
    *bytes = malloc((size_t)size + 1);
    if (*bytes == NULL)
        return "no memory for it";
    for (double i = 0.0; i < blocks; i++) {
        const double now = i + 1.0 == blocks && last > 0.0 ? last : block;
        if (!take_length(&sizes, coding, &packed) || !may_follow(stream, packed) ||
            !unpack_block(stream, (size_t)packed, *bytes + (size_t)at, (size_t)now))
            return "a block does not unpack to its length";
        at += now;
    }
    return NULL;
}

#else

static const char *unpack(const XmlCoding *coding, Stream *stream, double size, char **bytes)
{
    (void)coding, (void)stream, (void)size, (void)bytes;
    return "it is compressed, and this build has no zlib, which comes with voxel bodies";
}

#endif

static const char *read_plain(const XmlCoding *coding, Stream *stream, double size, char **bytes)
{
    double length;
    if (!take_length(stream, coding, &length))
        return "the file ends in front of it";
    if (length != size)
        return "it has another length than its numbers";
    if (!may_follow(stream, size))
        return "the file ends inside it";
    *bytes = malloc((size_t)size + 1);
    return *bytes == NULL                        ? "no memory for it"
           : !take(stream, *bytes, (size_t)size) ? "it is no base64, or the file ends inside it"
                                                 : NULL;
}

// --- numbers -----------------------------------------------------------------------------------

bool numbers_open(const XmlCoding *coding, const XmlArray *array, const char *what, double count,
                  Numbers *numbers, Status *status)
{
    Stream stream;
    *numbers = (Numbers){.array = array, .what = what, .count = count};
    numbers->big_endian = coding->big_endian;
    numbers->text = array->content;
    if (!array->given)
        return status_fail(status, STATUS_INVALID, "%s: a Piece has no %s", coding->path, what);
    if (array->ascii || count == 0.0)
        return true;
    if (!find_stream(coding, array, &stream))
        return fail(coding, array, status, what, "its offset is outside of AppendedData");
    const double size = count * array->type.size;
    const char *fault = coding->packed ? unpack(coding, &stream, size, &numbers->bytes)
                                       : read_plain(coding, &stream, size, &numbers->bytes);
    return fault == NULL || fail(coding, array, status, what, fault);
}

bool numbers_next(Numbers *numbers, double *number, Status *status)
{
    const XmlArray *array = numbers->array;
    if (!array->ascii && numbers->at < numbers->count) {
        const size_t at = (size_t)(numbers->at++) * (size_t)array->type.size;
        *number = number_decode(numbers->bytes + at, array->type, numbers->big_endian);
        return true;
    }
    const Word word = text_word_anywhere(&numbers->text);
    if (array->ascii && word_number(word, number))
        return true;
    return status_fail(status, STATUS_INVALID, "%s:%d: %s: '%s' where a number stands",
                       numbers->text.path, word.line, numbers->what, word_show(word).text);
}

void numbers_close(Numbers *numbers)
{
    free(numbers->bytes);
    numbers->bytes = NULL;
}

size_t xml_array_bytes(const XmlCoding *coding, const XmlArray *array, char *bytes, size_t most)
{
    size_t size = 0;
    double number;
    Text text = array->content;
    while (array->ascii && size < most && word_number(text_word_anywhere(&text), &number))
        bytes[size++] = number > 0.0 && number < 127.0 ? (char)number : ' ';
    Stream stream, ahead;
    if (array->ascii || !find_stream(coding, array, &stream))
        return size;
    // Its length is in front of it, of blocks that of the last one.
    double length[3] = {0.0, 0.0, 0.0};
    ahead = stream;
    for (int i = 0; i < (coding->packed ? 3 : 1); i++)
        if (!take_length(&ahead, coding, &length[i]))
            return 0;
    const double held = !coding->packed ? length[0] : length[2] > 0.0 ? length[2] : length[1];
    char *own = NULL;
    if (held <= (double)most &&
        (coding->packed ? unpack(coding, &stream, held, &own)
                        : read_plain(coding, &stream, held, &own)) == NULL) {
        size = (size_t)held;
        memcpy(bytes, own, size);
    }
    free(own);
    return size;
}
