"""What machine code asks of numba's runtime, written in LLVM's language, so that it runs without numba.

An array's memory has a head of six words: count of references, a function and a value for the end of what it holds, the
data, their size, and, here, whether the data are apart, as those of a list are, which grows. References are counted
without a lock, and in line: no two threads have one array, since what a call makes is its own until it is copied.
"""

from __future__ import annotations

MEMORY = """
declare ptr @malloc(i64)
declare ptr @realloc(ptr, i64)
declare void @free(ptr)

define ptr @NRT_Allocate(i64 %size) {
  %memory = call ptr @malloc(i64 %size)
  ret ptr %memory
}

define void @NRT_Free(ptr %memory) {
  call void @free(ptr %memory)
  ret void
}

define void @write_head(ptr %memory, ptr %end, ptr %data, i64 %size, i64 %apart) {
  store i64 1, ptr %memory
  %w1 = getelementptr i64, ptr %memory, i64 1
  store ptr %end, ptr %w1
  %w2 = getelementptr i64, ptr %memory, i64 2
  store i64 0, ptr %w2
  %w3 = getelementptr i64, ptr %memory, i64 3
  store ptr %data, ptr %w3
  %w4 = getelementptr i64, ptr %memory, i64 4
  store i64 %size, ptr %w4
  %w5 = getelementptr i64, ptr %memory, i64 5
  store i64 %apart, ptr %w5
  ret void
}

define ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 %align) {
  %step = zext i32 %align to i64
  %room = add i64 %size, 64
  %whole = add i64 %room, %step
  %memory = call ptr @malloc(i64 %whole)
  %none = icmp eq ptr %memory, null
  br i1 %none, label %full, label %head
full:
  ret ptr null
head:
  %first = ptrtoint ptr %memory to i64
  %last = sub i64 %step, 1
  %behind = add i64 %first, 64
  %over = add i64 %behind, %last
  %mask = sub i64 0, %step
  %place = and i64 %over, %mask
  %data = inttoptr i64 %place to ptr
  call void @write_head(ptr %memory, ptr null, ptr %data, i64 %size, i64 0)
  ret ptr %memory
}

define ptr @NRT_MemInfo_alloc(i64 %size) {
  %memory = call ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 16)
  ret ptr %memory
}

define ptr @NRT_MemInfo_new_varsize_dtor(i64 %size, ptr %end) {
  %memory = call ptr @malloc(i64 48)
  %data = call ptr @malloc(i64 %size)
  call void @write_head(ptr %memory, ptr %end, ptr %data, i64 %size, i64 1)
  ret ptr %memory
}

define ptr @NRT_MemInfo_varsize_realloc(ptr %memory, i64 %size) {
  %w3 = getelementptr i64, ptr %memory, i64 3
  %before = load ptr, ptr %w3
  %data = call ptr @realloc(ptr %before, i64 %size)
  store ptr %data, ptr %w3
  %w4 = getelementptr i64, ptr %memory, i64 4
  store i64 %size, ptr %w4
  ret ptr %data
}

define void @NRT_MemInfo_call_dtor(ptr %memory) {
  %w5 = getelementptr i64, ptr %memory, i64 5
  %apart = load i64, ptr %w5
  %is_apart = icmp ne i64 %apart, 0
  br i1 %is_apart, label %inside, label %head
inside:
  %w1 = getelementptr i64, ptr %memory, i64 1
  %end = load ptr, ptr %w1
  %w2 = getelementptr i64, ptr %memory, i64 2
  %value = load ptr, ptr %w2
  %w3 = getelementptr i64, ptr %memory, i64 3
  %data = load ptr, ptr %w3
  %w4 = getelementptr i64, ptr %memory, i64 4
  %size = load i64, ptr %w4
  %no_end = icmp eq ptr %end, null
  br i1 %no_end, label %data_apart, label %elements
elements:
  call void %end(ptr %data, i64 %size, ptr %value)
  br label %data_apart
data_apart:
  call void @free(ptr %data)
  br label %head
head:
  call void @free(ptr %memory)
  ret void
}

define void @NRT_incref(ptr %memory) alwaysinline {
  %none = icmp eq ptr %memory, null
  br i1 %none, label %done, label %count
count:
  %before = load i64, ptr %memory
  %now = add i64 %before, 1
  store i64 %now, ptr %memory
  br label %done
done:
  ret void
}

define void @NRT_decref(ptr %memory) alwaysinline {
  %none = icmp eq ptr %memory, null
  br i1 %none, label %done, label %count
count:
  %before = load i64, ptr %memory
  %now = sub i64 %before, 1
  store i64 %now, ptr %memory
  %last = icmp eq i64 %now, 0
  br i1 %last, label %end, label %done
end:
  call void @NRT_MemInfo_call_dtor(ptr %memory)
  br label %done
done:
  ret void
}

define void @curveline_release(ptr %memory) {
  call void @NRT_decref(ptr %memory)
  ret void
}
"""
"""Memory that is counted, and given back with the last reference."""

ERRORS = """
@PyExc_RuntimeError = global ptr null

define void @PyErr_SetString(ptr %kind, ptr %text) {
  ret void
}

define ptr @PyUnicode_FromKindAndData(i32 %kind, ptr %data, i64 %size) {
  ret ptr null
}

define i64 @PyObject_Hash(ptr %object) {
  ret i64 -1
}

define ptr @PyTuple_Pack(i64 %size, ...) {
  ret ptr null
}
"""
"""What would make the text of an exception: a kernel that fails gives its status only, and nothing calls these."""
