! SPDX-License-Identifier: MIT
! The functions of sluice.h for Fortran. Texts end with c_null_char; node numbers start at 0.
module sluice
  use, intrinsic :: iso_c_binding
  implicit none
  interface
    type(c_ptr) function sluice_open(role, case_file, out_dir, message, size) bind(c)
      import
      character(kind=c_char), intent(in) :: role(*), case_file(*), out_dir(*)
      character(kind=c_char), intent(out) :: message(*)
      integer(c_size_t), value :: size
    end function
    subroutine sluice_close(participant) bind(c)
      import
      type(c_ptr), value :: participant
    end subroutine
    type(c_ptr) function sluice_message(participant) bind(c)
      import
      type(c_ptr), value :: participant
    end function
    integer(c_int) function sluice_set_mesh(participant, dim, n_nodes, positions, &
                                            nodes_per_face, n_faces, faces) bind(c)
      import
      type(c_ptr), value :: participant
      integer(c_int), value :: dim, nodes_per_face
      integer(c_size_t), value :: n_nodes, n_faces
      real(c_double), intent(in) :: positions(*)
      integer(c_int), intent(in) :: faces(*)
    end function
    integer(c_int) function sluice_initialize(participant) bind(c)
      import
      type(c_ptr), value :: participant
    end function
    integer(c_int) function sluice_advance(participant, dt) bind(c)
      import
      type(c_ptr), value :: participant
      real(c_double), value :: dt
    end function
    integer(c_int) function sluice_finalize(participant) bind(c)
      import
      type(c_ptr), value :: participant
    end function
    integer(c_int) function sluice_write_data(participant, field, values, n_values) bind(c)
      import
      type(c_ptr), value :: participant
      character(kind=c_char), intent(in) :: field(*)
      real(c_double), intent(in) :: values(*)
      integer(c_size_t), value :: n_values
    end function
    integer(c_int) function sluice_read_data(participant, field, relative_time, values, &
                                             n_values) bind(c)
      import
      type(c_ptr), value :: participant
      character(kind=c_char), intent(in) :: field(*)
      real(c_double), value :: relative_time
      real(c_double), intent(out) :: values(*)
      integer(c_size_t), value :: n_values
    end function
    integer(c_int) function sluice_report_failure(participant, reason) bind(c)
      import
      type(c_ptr), value :: participant
      character(kind=c_char), intent(in) :: reason(*)
    end function
    integer(c_int) function sluice_is_coupling_ongoing(participant) bind(c)
      import
      type(c_ptr), value :: participant
    end function
    integer(c_int) function sluice_is_time_window_complete(participant) bind(c)
      import
      type(c_ptr), value :: participant
    end function
    integer(c_int) function sluice_requires_writing_checkpoint(participant) bind(c)
      import
      type(c_ptr), value :: participant
    end function
    integer(c_int) function sluice_requires_reading_checkpoint(participant) bind(c)
      import
      type(c_ptr), value :: participant
    end function
    real(c_double) function sluice_max_time_step_size(participant) bind(c)
      import
      type(c_ptr), value :: participant
    end function
    real(c_double) function sluice_time(participant) bind(c)
      import
      type(c_ptr), value :: participant
    end function
    integer(c_size_t) function length_of(text) bind(c, name='strlen')
      import
      type(c_ptr), value :: text
    end function
  end interface
  private :: length_of
contains
  !> What sluice_message says, as a text of Fortran.
  function sluice_text(participant) result(text)
    type(c_ptr), value :: participant
    character(len=:), allocatable :: text
    character(kind=c_char), pointer :: letters(:)
    integer :: k
    call c_f_pointer(sluice_message(participant), letters, [length_of(sluice_message(participant))])
    allocate (character(len=size(letters)) :: text)
    do k = 1, size(letters)
      text(k:k) = letters(k)
    end do
  end function
end module
