! SPDX-License-Identifier: MIT
! A complete structural solver in Fortran: a rigid wall on a spring, by the trapezoidal rule.
! Prints the last displacement. Usage: dummy_solid_fortran CASE.toml --out DIR, or --check
program solid
  use, intrinsic :: iso_c_binding
  use, intrinsic :: iso_fortran_env, only: error_unit
  use sluice
  implicit none
  real(c_double), parameter :: mass = 1, stiffness = 4e4_c_double, x(6) = [0, 0, 0, 1, 0, 2] / 2d0
  integer(c_size_t), parameter :: n = 6
  character(kind=c_char, len=500) :: case_file, option, folder, message
  type(c_ptr) :: bridge
  real(c_double) :: force(6), d, v, v_new, dt, saved(2)
  call get_command_argument(1, case_file)
  call get_command_argument(2, option)
  call get_command_argument(3, folder)
  if (option == '--check') stop
  if (option /= '--out' .or. command_argument_count() /= 3) call give_up('usage: CASE.toml --out DIR')
  bridge = sluice_open('solid' // c_null_char, trim(case_file) // c_null_char, &
                       trim(folder) // c_null_char, message, 500_c_size_t)
  if (.not. c_associated(bridge)) call give_up(message(:index(message, c_null_char) - 1))
  d = 0.01_c_double; v = 0
  call ensure(sluice_set_mesh(bridge, 2, 3_c_size_t, x, 2, 2_c_size_t, [0, 1, 1, 2]))
  call ensure(sluice_write_data(bridge, 'displacement' // c_null_char, along_x(d), n))
  call ensure(sluice_initialize(bridge))
  do while (sluice_is_coupling_ongoing(bridge) == 1)
    if (sluice_requires_writing_checkpoint(bridge) == 1) saved = [d, v]
    dt = sluice_max_time_step_size(bridge)
    call ensure(sluice_read_data(bridge, 'force' // c_null_char, dt, force, n))
    v_new = (mass * v + dt * sum(force(1::2)) - dt * stiffness * (d + dt * v / 4)) &
            / (mass + dt**2 * stiffness / 4)
    d = d + dt * (v + v_new) / 2
    v = v_new
    call ensure(sluice_write_data(bridge, 'displacement' // c_null_char, along_x(d), n))
    call ensure(sluice_write_data(bridge, 'velocity' // c_null_char, along_x(v), n))
    call ensure(sluice_advance(bridge, dt))
    if (sluice_requires_reading_checkpoint(bridge) == 1) then
      d = saved(1)
      v = saved(2)
    end if
  end do
  call ensure(sluice_finalize(bridge))
  print '(es23.15)', d
contains
  function along_x(value) result(values)
    real(c_double), intent(in) :: value
    real(c_double) :: values(6)
    values = [value, 0d0, value, 0d0, value, 0d0]
  end function
  subroutine ensure(status)
    integer(c_int), intent(in) :: status
    if (status /= 0) call give_up(sluice_text(bridge))
  end subroutine
  subroutine give_up(reason) ! the bridge has told the partner already
    character(len=*), intent(in) :: reason
    write (error_unit, '(a)') 'dummy_solid_fortran: ' // reason
    stop 1, quiet=.true.
  end subroutine
end program
