// SPDX-License-Identifier: MIT
// Who may come in: names, origins and tokens.
#include "door.h"
#include "test.h"

#include <unistd.h>

TEST(only_addresses_localhost_and_the_given_name_are_admitted)
{
    static const char *const yes[] = {"localhost",   "localhost:8080",     "LOCALHOST:1",
                                      "127.0.0.1",   "127.0.0.1:8080",     "192.168.7.1:80",
                                      "[::1]",       "[::1]:8080",         "lab.example:8080",
                                      "Lab.Example", "[2001:db8::1]:65535"};
    static const char *const no[] = {"",
                                     "evil.example",
                                     "evil.example:8080",
                                     "127.0.0.1.evil.example",
                                     "localhost.evil.example",
                                     "localhost:",
                                     "localhost:0",
                                     "localhost:65536",
                                     "localhost:80:80",
                                     "localhost: 80",
                                     "localhost:+80",
                                     "localhost:8080/",
                                     " localhost",
                                     "user@localhost",
                                     "[::1",
                                     "[::1]x",
                                     "[localhost]",
                                     "::1",
                                     "127.1",
                                     "lab.example.evil"};
    Door door = {.host = "lab.example"};
    for (size_t k = 0; k < sizeof yes / sizeof *yes; k++) {
        if (!door_admits_host(&door, yes[k]))
            fail_msg("'%s' is kept out", yes[k]);
    }
    for (size_t k = 0; k < sizeof no / sizeof *no; k++) {
        if (door_admits_host(&door, no[k]))
            fail_msg("'%s' is let in", no[k]);
    }
    assert_false(door_admits_host(&door, NULL));
    assert_false(door_admits_host(&(Door){0}, "lab.example"));
    char longest[4000];
    memset(longest, '1', sizeof longest - 1);
    longest[sizeof longest - 1] = '\0';
    assert_false(door_admits_host(&door, longest));
}

TEST(only_pages_of_this_server_are_of_the_right_origin)
{
    const Door door = {.host = "sim.example"};
    const char *host = "127.0.0.1:8080";
    assert_true(door_admits_origin(&door, NULL, host)); // no browser
    assert_true(door_admits_origin(&door, "http://127.0.0.1:8080", host));
    assert_true(door_admits_origin(&door, "https://127.0.0.1:8080", host)); // behind a proxy
    // One that asks by address, of the name that --host gives.
    assert_true(door_admits_origin(&door, "https://sim.example", host));
    assert_true(door_admits_origin(&door, "https://Sim.Example:8443", host));
    assert_false(door_admits_origin(&(Door){0}, "https://sim.example", host));
    static const char *const no[] = {"http://127.0.0.1",
                                     "http://127.0.0.1:8081",
                                     "http://127.0.0.1:80801",
                                     "http://localhost:8080",
                                     "http://evil.example",
                                     "https://sim.example.evil.example",
                                     "https://sim.example:",
                                     "https://sim.example:80@evil.example",
                                     "https://",
                                     "http://127.0.0.1:8080.evil.example",
                                     "http://127.0.0.1:8080/",
                                     "ftp://127.0.0.1:8080",
                                     "127.0.0.1:8080",
                                     "null",
                                     ""};
    for (size_t k = 0; k < sizeof no / sizeof *no; k++) {
        if (door_admits_origin(&door, no[k], host))
            fail_msg("'%s' is let in", no[k]);
    }
    assert_false(door_admits_origin(&door, "http://127.0.0.1:8080", NULL));
}

TEST(the_whole_token_is_needed)
{
    Door door = {.token = "0123456789abcdef"};
    assert_true(door_admits(&door, "0123456789abcdef"));
    static const char *const no[] = {"", "0123456789abcde", "0123456789abcdeF", "0123456789abcdef0",
                                     " 0123456789abcdef"};
    for (size_t k = 0; k < sizeof no / sizeof *no; k++)
        assert_false(door_admits(&door, no[k]));
    assert_false(door_admits(&door, NULL));
    // Where there is no token, an empty one opens nothing.
    assert_false(door_admits(&(Door){.cookie = "c"}, ""));
}

TEST(drawn_tokens_differ_and_are_long)
{
    Door a = {0}, b = {0};
    PliantError error;
    assert_true(door_draw_token(&a, &error));
    assert_true(door_draw_token(&b, &error));
    assert_int_equal(strlen(a.token), 32);
    assert_int_equal(strspn(a.token, "0123456789abcdef"), 32);
    assert_string_not_equal(a.token, b.token);
}

TEST(tokens_of_files_are_checked)
{
    static const struct {
        const char *text;
        bool good;
    } cases[] = {{"0123456789abcdef\n", true},       {"0123456789abcdef", true},
                 {"0123-56789_bcdef\r\nmore", true}, {"0123456789abcde\n", false},
                 {"0123456789 abcdef", false},       {"", false},
                 {"\n0123456789abcdef", false}};
    char path[] = "/tmp/pliant-token-XXXXXX";
    int fd = mkstemp(path);
    assert_true(fd >= 0);
    close(fd);
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        FILE *file = fopen(path, "w");
        assert_non_null(file);
        fputs(cases[k].text, file);
        fclose(file);
        Door door = {0};
        PliantError error = {0};
        if (door_read_token(&door, path, &error) != cases[k].good)
            fail_msg("'%s': %s", cases[k].text, error.text);
        if (cases[k].good)
            assert_int_equal(strlen(door.token), 16);
        else
            expect_in(error.text, path);
    }
    unlink(path);
    PliantError error;
    assert_false(door_read_token(&(Door){0}, path, &error));
    expect_in(error.text, "No such file");
}
